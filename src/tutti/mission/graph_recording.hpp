// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"

namespace tutti::mission {

/// The part of a pose graph of several robots that is of one of them.
struct GraphRecording {
  Trajectory odometry;                         ///< From the origin, along the graph's odometry.
  std::vector<Matrix6d> increment_covariance;  ///< As in Recording.
  Trajectory reference;                        ///< The vertices, where the graph has them; else empty.
  std::vector<RecordedClosure> closures;       ///< Those whose later end, in the order of the file, is this robot.
  std::vector<std::string> notes;
};

/// Reads one robot from a PyFG or JRL file. Edges between consecutive numbers are odometry, the first one of each pair;
/// all others are closures. Fails when the file has no such robot, numbers or odometry are missing in its chain, or its
/// vertices have no increasing stamps.
Result<GraphRecording> read_graph_recording(const std::string& path, const std::string& robot);

/// The mission file of `tutti run --graph`: all robots of the graph, with its closures at their time of arrival.
Result<std::string> graph_mission(const std::string& file, const std::filesystem::path& data);

}  // namespace tutti::mission
