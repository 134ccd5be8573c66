// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <span>
#include <vector>

#include "tutti/estimation/gnc.hpp"
#include "tutti/server/submap_fixes.hpp"

namespace tutti::server {

/// A node of the map whose tilt only odometry determines, with the orientation in enu that odometry gives it.
struct LevelNode {
  std::size_t node = 0;
  Eigen::Quaterniond R_enu_body;
};

/// The result of bend_to_fixes().
struct FixFactors {
  std::vector<FixObjection> objections;   ///< Per submap of PlacedFixes.
  std::vector<OneFix> joined;             ///< Per submap of PlacedFixes: its fixes as one.
  std::map<ChainId, double> understated;  ///< Fixes::understated
  Pose3 T_enu_world;
  std::vector<PoseGraphEdge> edges;  ///< Fixes::edges
};

/// Moves the nodes of the map (all parts that are tied to the earth, in one world) to where odometry, closures and the
/// fixes that agree with these have them. Which fixes agree is decided by truncated least squares (GNC), as for
/// closures, with the covariances that fixes state; a receiver's variances are raised as far as a quarter of its fixes
/// needs. Fixes that agree count as often as their correlation allows. Submaps with an objection are not tried. Returns
/// false, and changes nothing, when the problem cannot be solved.
bool bend_to_fixes(const PlacedFixes& placed, const std::vector<LevelNode>& level, const estimation::GncConfig& gnc,
                   MapEstimate& map, FixFactors& factors);

/// Vector from a submap's fixes to the map, in enu, m.
Eigen::Vector3d missed_by(const OneFix& fix, std::span<const Pose3> T_world_body, const Pose3& T_enu_world);

}  // namespace tutti::server
