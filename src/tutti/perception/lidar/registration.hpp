// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/perception/lidar/bend.hpp"
#include "tutti/perception/lidar/closure_config.hpp"
#include "tutti/perception/lidar/oriented_cloud.hpp"

namespace tutti::lidar {

struct RegistrationResult {
  Pose3 T_target_source;
  /// Covariance of the right perturbation of T_target_source (geometry/pose3.hpp), from the variance of the residuals
  /// and the number of independent ones (batch means, docs/math.md). Without the bend of the submaps (bend.hpp).
  Matrix6d covariance = Matrix6d::Identity();
  double overlap = 0.0;       ///< Share of the source points that have a target point near, with a similar normal.
  double plane_rmse_m = 0.0;  ///< Point to plane, over the overlapping points.
  /// Point-to-plane residuals over what OrientedCloud::roughness expects (root of the ratio of mean squares), in the
  /// direction in which that is largest: about 1 when both show one place. 0 without roughness.
  double misfit = 0.0;
  /// Least eigenvalue of sum n n^T over the overlap, trace 1: 0 = free to slide.
  double min_translation_eigenvalue = 0.0;
  Eigen::Vector3d weakest_source = Eigen::Vector3d::UnitX();        ///< Direction of that eigenvalue, source frame.
  Eigen::Vector3d overlap_centre_source = Eigen::Vector3d::Zero();  ///< Mean of the overlapping points, source frame.
  int iterations = 0;
  bool converged = false;
};

/// Robust multi-scale point-to-plane registration (Chen and Medioni 1992, Geman-McClure loss) of `source` on `target`,
/// from T_init. config.levels must not be empty. With fewer than 20 correspondences at the end `converged` is false,
/// and overlap and what is measured over it stay 0.
RegistrationResult register_clouds(const OrientedCloud& target, const OrientedCloud& source, const Pose3& T_init,
                                   const RegistrationConfig& config);

/// At most `count` contacts of two aligned clouds, evenly spread over the points of the source.
std::vector<Contact> find_contacts(const OrientedCloud& target, const OrientedCloud& source,
                                   const Pose3& T_target_source, std::size_t count, const RegistrationConfig& config);

/// Point-to-plane residual of every point against its nearest other point that could be a correspondence in
/// register_clouds(), m; NaN where there is none. Noise and rough surfaces leave as much between two clouds of one
/// place, but not more.
std::vector<float> self_residuals(const OrientedCloud& cloud, const RegistrationConfig& config);

}  // namespace tutti::lidar
