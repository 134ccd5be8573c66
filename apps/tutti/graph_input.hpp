// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/server/graph_judge.hpp"

/// Reads pose graphs of several robots from g2o, PyFG and JRL files, with what is known about them; for `tutti optimise
/// --robust` and for Python.
namespace tutti::app {

/// Which file to read, and what is known beside it.
struct GraphSource {
  std::string path;
  std::vector<std::string> more;     ///< Further g2o files of the same graph, as of other robots.
  std::vector<std::int64_t> robots;  ///< For g2o: the first vertex id of each robot; empty: as in the file.
  std::string truth;                 ///< A file whose vertices are the truth, "none", or empty: PyFG's own truth.
  std::string right;  ///< A file without the wrong closures; empty: *_no_outliers beside the graph, if there is one.
};

/// A pose graph with its robots' and vertices' names.
struct NamedGraph {
  server::RobotGraph robots;                      ///< With the file's poses.
  std::vector<std::string> names;                 ///< Per vertex: its id, or "A12".
  std::vector<std::int64_t> ids;                  ///< Per vertex, its id in a g2o file; for "A12", GTSAM's symbol key.
  std::vector<std::string> robot_names;           ///< By RobotId::value.
  std::vector<std::optional<Pose3>> fixed_poses;  ///< Per vertex: the pose that a FIX line or a prior states.
  bool is_pyfg = false;                           ///< Or JRL.
  bool has_poses = true;  ///< False: the file lacks poses of vertices, which are the identity here.
  bool is_2d = false;
  std::size_t replaced = 0;  ///< Number of information or covariance matrices that were not positive semidefinite.
  std::size_t repeated = 0;  ///< Edges that were there twice, and count once.
  std::map<std::string, std::size_t> left_out;  ///< Lines that are not read, by their tags.
  std::string robots_from;                      ///< For people: how robots were distinguished,
  std::string stamps_from;                      ///< and where the times are from.
};

/// The truth that results are scored against.
struct GraphTruth {
  std::vector<std::optional<Pose3>> poses;  ///< T_world_body per vertex; empty: unknown.
  std::vector<bool> right;                  ///< Per edge, whether it is right; empty: unknown.
};

/// Reads a graph. Robots in g2o files are distinguished by source.robots, by IN_stamps.csv beside the file, or by
/// GTSAM's symbol keys (letter << 56 | number); failing these, a robot begins where no edge joins a vertex to the one
/// before it. Times are from IN_stamps.csv, or from PyFG's vertices or odometry edges, if they increase along every
/// robot; otherwise the n-th vertex of a robot counts as at n seconds. Fails when the file cannot be read.
Result<NamedGraph> read_graph(const GraphSource& source);
/// The same for a g2o graph that was read already; `stamps` are those of IN_stamps.csv, or empty.
Result<NamedGraph> name_graph(const GraphSource& source, const formats::G2oFile& file,
                              std::span<const formats::VertexStamp> stamps);
/// The server's map of the graph (server::judge_graph). Each component is placed so that its first fixed vertex, or
/// else its first vertex, is where the file has it. Fails when the graph cannot be solved, or a component has several
/// vertices with FIX lines. Once `stop` is true, no further decision is tried.
Result<server::JudgedGraph> judge(const NamedGraph& graph, const std::string& path,
                                  const std::function<bool()>& stop = {});
/// Reads the truth that `source` names; empty when there is none. Fails when a file cannot be read or does not fit the
/// graph.
Result<GraphTruth> read_truth(const GraphSource& source, const NamedGraph& graph);

}  // namespace tutti::app
