// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/compare_trajectories.hpp"

namespace tutti::app {

/// One side of a comparison: a trajectory (TUM, EuRoC csv, KITTI), a pose graph (.g2o), or what `tutti run` left in a
/// folder. One entry per robot, each with at least one pose.
struct CompareSide {
  std::vector<mission::NamedTrajectory> robots;
  std::vector<std::string> notes;
  std::vector<std::string> judged_notes;  ///< Of its own motion's covariance: said of the side that is judged.
};

/// Not what cannot be looked at.
bool is_folder(const std::string& path);

/// Which file or folder; of a folder, the files *_<estimate>.tum.
struct CompareSource {
  std::string path;
  std::string estimate;
};

/// A graph x.g2o takes stamps and robots from x_stamps.csv beside it. Without it, from the other side's, if that is a
/// graph of the very same vertices; or, when neither side has times, vertex n is one robot's pose at n seconds. Notes
/// say so; a graph without times beside anything else is refused. A graph's edges give each motion's covariance when
/// every pose has one to the next.
Result<std::pair<CompareSide, CompareSide>> load_sides(const CompareSource& a, const CompareSource& b);

/// Robots that both sides have, by name; two sides of one robot each belong together whatever their names.
struct ComparePair {
  const mission::NamedTrajectory* a = nullptr;
  const mission::NamedTrajectory* b = nullptr;
};
/// Fails when there is none. Robots that only one side has go to `notes`.
Result<std::vector<ComparePair>> pair_robots(const CompareSide& a, const CompareSide& b,
                                             std::vector<std::string>& notes);

}  // namespace tutti::app
