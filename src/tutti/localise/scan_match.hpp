// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/localise/local_map.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/perception/fit/scan_step.hpp"

namespace tutti::localise {

/// A scan on the map, from where the robot should be.
struct ScanMatch {
  RelativePose T_world_body;   ///< As the scan shows it; right tangent.
  bool converged = false;      ///< False: too little of the scan lies on the map, and the pose is where it began.
  double overlap = 0.0;        ///< Share of the scan's points that lie on the map.
  double plane_rmse_m = 0.0;   ///< Point to plane, over these.
  double contradiction = 0.0;  ///< Share of the points in view that stand where the other side looked through.
  int in_view = 0;             ///< Points of either side that the other looked at.
};

/// Registers a scan on a local map (lidar::register_clouds()) from `T_world_body`, and counts what contradicts it both
/// ways: points of the scan where the map's robots looked through, and points of the map where the scan did.
ScanMatch match_scan(const LocalMap& map, const fit::FitScan& scan, const Pose3& T_world_body);

/// What a scan says about where the robot should be.
enum class Evidence {
  confirms,  ///< It lies on the map there.
  nothing,   ///< The map shows too little of what the scan sees.
  against    ///< It cannot have been taken there.
};
struct Assessment {
  Evidence evidence = Evidence::nothing;
  std::string why;  ///< As a sentence's end; empty when it confirms.
};
/// `predicted` is where the robot should be with its covariance, `match` begun there.
Assessment assess(const ScanMatch& match, const RelativePose& predicted);

}  // namespace tutti::localise
