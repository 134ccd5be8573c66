// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/compare_trajectories.hpp"

namespace tutti::app {

/// One side of a comparison: a trajectory (TUM, EuRoC csv, KITTI), a pose graph (.g2o), or what `tutti run` left in a
/// folder. One entry per robot, each with at least one pose.
struct CompareSide {
  std::vector<mission::NamedTrajectory> robots;
  std::vector<std::string> notes;
};

/// `estimate`: of a folder, the files *_<estimate>.tum. A graph x.g2o takes stamps and robots from x_stamps.csv beside
/// it; without that, vertex n is one robot's pose at n seconds. Its edges give each motion's covariance when every pose
/// has one to the next; a note says when not.
Result<CompareSide> load_side(const std::string& path, const std::string& estimate);

/// Robots that both sides have, by name; two sides of one robot each belong together whatever their names.
struct ComparePair {
  const mission::NamedTrajectory* a = nullptr;
  const mission::NamedTrajectory* b = nullptr;
};
/// Fails when there is none. Robots that only one side has go to `notes`.
Result<std::vector<ComparePair>> pair_robots(const CompareSide& a, const CompareSide& b,
                                             std::vector<std::string>& notes);

}  // namespace tutti::app
