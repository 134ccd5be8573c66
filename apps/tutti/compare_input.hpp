// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/compare_trajectories.hpp"

namespace tutti::app {

/// One side of a comparison: a trajectory (TUM, EuRoC csv, KITTI), a pose graph (.g2o), or a folder that `tutti run`
/// has written. It has one entry per robot, each with at least one pose.
struct CompareSide {
  std::vector<mission::NamedTrajectory> robots;
  std::vector<std::string> notes;
  /// About the covariance of its own motion; only used when this side is judged.
  std::vector<std::string> judged_notes;
};

/// False also for paths that cannot be examined.
bool is_folder(const std::string& path);

/// A file or folder; of a folder, the files *_<estimate>.tum are used.
struct CompareSource {
  std::string path;
  std::string estimate;
};

/// Loads both sides. A graph x.g2o gets stamps and robots from x_stamps.csv beside it; without that file, from the
/// other side, if that is a graph of the same vertices; or, when neither side has times, vertex n counts as one robot's
/// pose at n seconds. Notes report it. A graph without times beside anything else fails. A graph's edges give the
/// covariance of each motion when every pose has an edge to the next.
Result<std::pair<CompareSide, CompareSide>> load_sides(const CompareSource& a, const CompareSource& b);

/// A robot that both sides have, by name. When each side has one robot, these belong together whatever their names.
struct ComparePair {
  const mission::NamedTrajectory* a = nullptr;
  const mission::NamedTrajectory* b = nullptr;
};
/// Fails when there is no such pair. Robots that only one side has are added to `notes`.
Result<std::vector<ComparePair>> pair_robots(const CompareSide& a, const CompareSide& b,
                                             std::vector<std::string>& notes);

}  // namespace tutti::app
