// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/server/graph_judge.hpp"

/// Of `tutti optimise --robust`: pose graphs of several robots from g2o and PyFG files, and what is known of them.
namespace tutti::app {

struct GraphSource {
  std::string path;
  std::vector<std::int64_t> robots;  ///< g2o: the first vertex id of each robot; empty: as the file tells.
  std::string truth;                 ///< A file whose vertices are the truth, "none", or empty: PyFG's own.
  std::string right;                 ///< A file without the wrong closures; empty: *_no_outliers beside it, if any.
};

struct NamedGraph {
  server::RobotGraph robots;               ///< Its poses are those of the file.
  std::vector<std::string> names;          ///< Of the vertices: their id, or "A12".
  std::vector<std::int64_t> ids;           ///< Of the vertices in a g2o file; of "A12" GTSAM's symbol key.
  std::vector<std::string> robot_names;    ///< By RobotId::value.
  std::vector<std::optional<Pose3>> held;  ///< Of the vertices: where FIX or a prior says that they are.
  bool is_pyfg = false;
  bool is_2d = false;
  std::size_t replaced = 0;  ///< Information or covariance matrices that were not positive semidefinite.
  std::string robots_from;   ///< For people: how robots were told apart,
  std::string stamps_from;   ///< ... and where the times are from.
};

/// What the score is against.
struct GraphTruth {
  std::vector<std::optional<Pose3>> poses;  ///< T_world_body of the vertices; empty: nothing is known.
  std::vector<bool> right;                  ///< Of the edges; empty: nothing is known.
};

/// Robots of g2o files are told apart by source.robots, by IN_stamps.csv beside the file, by GTSAM's symbol keys
/// (letter << 56 | number), or else begin where no edge joins a vertex to the one before it. Times are those of
/// IN_stamps.csv or of PyFG's vertices or odometry edges, where they increase along every robot; otherwise the n-th
/// vertex of a robot counts as at n seconds.
Result<NamedGraph> read_graph(const GraphSource& source);
Result<GraphTruth> read_truth(const GraphSource& source, const NamedGraph& graph);

}  // namespace tutti::app
