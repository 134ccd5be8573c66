// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <optional>
#include <span>

#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/perception/lidar/oriented_cloud.hpp"
#include "tutti/perception/lidar/registration.hpp"

namespace tutti::fit {

/// One scan, thinned and with normals, in the body frame at its stamp.
struct FitScan {
  Timestamp stamp;
  lidar::OrientedCloud cloud;
};

/// Points nearer than `min_range_m` are on the robot itself and left out. At most kMostPoints are kept.
FitScan make_fit_scan(Timestamp stamp, const PointCloud& cloud, double min_range_m);

/// The covariance (right tangent) of a registration of scans with what it does not know of itself: how far along they
/// slide, where hardly anything faces that direction; and `floor_m` and `floor_rad`, which it errs by at least.
Matrix6d widened(Matrix6d covariance, const lidar::RegistrationResult& registration, double floor_m, double floor_rad);

/// How the body moved from one scan to the next, as the two scans show it.
struct ScanStep {
  Timestamp from, to;
  Pose3 T_from_to;
  /// Right tangent [m; rad]. Large along directions in which the scans slide on each other, such as a corridor's axis.
  Matrix6d covariance = Matrix6d::Identity();
  double overlap = 0.0;  ///< Share of the newer scan's points that lie on the older one.
  int registrations = 0;
};

/// Odometry's motion over the step, whose clock `offset_s` is added to; nothing where it has no poses, or none within
/// `max_gap_s` of each other.
std::optional<Pose3> motion_over(const ScanStep& step, std::span<const StampedPose> odometry, double offset_s = 0.0,
                                 double max_gap_s = std::numeric_limits<double>::infinity());

/// Registers the newer scan on the older one (lidar::register_clouds()) from what odometry says; where that does not
/// confirm odometry, also from standing still and from `T_as_before`, the motion that a steady body would have made.
/// Where two ends fit equally well, their difference is part of the covariance: the scans cannot tell. Nothing when the
/// scans have too little in common.
std::optional<ScanStep> step_between(const FitScan& from, const FitScan& to, const Pose3& T_by_odometry,
                                     const Pose3& T_as_before = {});

/// The motion of another length of time at the same speeds.
Pose3 steady_motion(const ScanStep& step, double duration_s);

}  // namespace tutti::fit
