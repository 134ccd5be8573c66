// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/localise/known_map.hpp"
#include "tutti/model/start_pose.hpp"

namespace tutti::localise {

/// Where a robot may be by a start pose, on one level of a floor of the map.
struct StartTries {
  std::uint32_t floor = 1;
  RelativePose T_world_body;  ///< The start pose; where only x, y and heading are meant, with the rest of the map's.
  /// Poses from which registration reaches all that is within two standard deviations, nearest first; kMostTries at
  /// most.
  std::vector<Pose3> from;
};
inline constexpr std::size_t kMostTries = 300;

/// One for each level where the map's robots stood at or near the start pose, of the floor that it names or of all: one
/// a floor, unless only x, y and heading are meant and levels lie above each other. `start` has a pose. Fails when the
/// map has nobody within kNearStart_m of it, or when it is so uncertain that the whole map may as well be searched.
Result<std::vector<StartTries>> tries_of(const KnownMap& map, const StartPose& start);
inline constexpr double kNearStart_m = 15.0;
inline constexpr double kMostStartSigma_m = 3.0;

}  // namespace tutti::localise
