// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti::server {

/// The position of an antenna in the map, and the position that a fix states for it (enu), m.
struct FixedPoint {
  Eigen::Vector3d p_world;
  Eigen::Vector3d p_enu;
  Eigen::Matrix3d covariance;  ///< p_enu's, m^2.
  double weight = 1.0;         ///< The number of independent fixes that this point counts as.
  std::size_t submap = 0;      ///< Position of the point's submap in the caller's list; ascending.
};

/// How a rigid part of a map lies on the earth.
struct FixAlignment {
  Pose3 T_enu_world;
  bool is_levelled = false;  ///< The world's z axis was taken as up, because the points do not determine the tilt.
  /// Covariance of T_enu_world, as a shift of the points' middle and a rotation about that middle, along the axes of
  /// enu; m and rad. Where the map was levelled, the tilt has kSigmaLevel_rad.
  Matrix6d covariance = Matrix6d::Zero();
  Eigen::Vector3d middle_enu = Eigen::Vector3d::Zero();
  std::vector<bool> fits;      ///< Per point: it agrees with the alignment.
  double median_miss_m = 0.0;  ///< Median distance between the points and their fixes.
  std::string why_not;         ///< Why the alignment is not certain; empty when it is.

  [[nodiscard]] double sigma_m() const;  ///< Standard deviation of the middle's position, along the worst direction.
  [[nodiscard]] double sigma_yaw_rad() const;
};

/// Standard deviation of the direction that an odometry takes for up, where nothing else measures it.
inline constexpr double kSigmaLevel_rad = 0.02;

/// The rigid alignment that most points agree with, even if up to half of them are wrong (least median of squares,
/// Rousseeuw 1984), refined by least squares over those points. It is certain when it determines the heading to 5
/// degrees, and when the median miss is either below a seventh of the points' spread or explained by their covariances.
/// Deterministic.
FixAlignment align_fixes(std::span<const FixedPoint> points);

}  // namespace tutti::server
