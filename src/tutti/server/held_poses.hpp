// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// The poses of a map that does not move: T_world_body of all its keyframes, in the world of their floor. Later
/// keyframes are laid beside them.
struct HeldPose {
  Pose3 T_world_body;
  std::uint32_t floor = 0;  ///< A number for each world.
};
using HeldPoses = std::map<KeyframeId, HeldPose>;

/// The floor that most of these keyframes are held on, the lowest among equals; nothing where none of them is held.
std::optional<std::uint32_t> main_floor(const HeldPoses& held, const std::vector<KeyframeId>& nodes);

/// The same map with these poses, to the bit, in the world that they are in. All others of their component are where
/// odometry and the accepted closures put them then (estimation/fixed_nodes.hpp); other components stay as they are.
/// Where closures have joined floors, the main one stays, and the others move to where they are in its world.
/// When that cannot be solved, the others are laid on the held ones as they are, rigidly.
MapEstimate hold(MapEstimate map, const HeldPoses& held, const estimation::SolverConfig& config);

}  // namespace tutti::server
