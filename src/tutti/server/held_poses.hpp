// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// The poses of a map that does not move: T_world_body of all its keyframes, in one world. What comes later is laid
/// beside them.
using HeldPoses = std::map<KeyframeId, Pose3>;

/// The same map with these poses, to the bit, in the world that they are in. All others of their component are where
/// odometry and the accepted closures put them then (estimation/fixed_nodes.hpp); other components stay as they are.
/// When that cannot be solved, the others are laid on the held ones as they are, rigidly.
MapEstimate hold(MapEstimate map, const HeldPoses& held, const estimation::SolverConfig& config);

}  // namespace tutti::server
