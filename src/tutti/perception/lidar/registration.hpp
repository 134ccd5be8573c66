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
  /// Right perturbation of T_target_source (geometry/pose3.hpp): what the residuals say, by their variance and by how
  /// many of them are independent. How far a submap is bent is not in it (bend.hpp).
  Matrix6d covariance = Matrix6d::Identity();
  double overlap = 0.0;       ///< Share of the source points with a target point near and a like normal.
  double plane_rmse_m = 0.0;  ///< Point to plane, over the overlapping points.
  /// Point-to-plane residuals over what OrientedCloud::roughness expects (root of the ratio of mean squares), in the
  /// direction in which that is largest: about 1 when both show one place. 0 without roughness.
  double misfit = 0.0;
  double min_translation_eigenvalue = 0.0;  ///< Of sum n n^T over the overlap, trace 1: 0 = free to slide.
  Eigen::Vector3d weakest_source = Eigen::Vector3d::UnitX();        ///< The direction of that, source frame.
  Eigen::Vector3d overlap_centre_source = Eigen::Vector3d::Zero();  ///< Mean of the overlapping points, source frame.
  int iterations = 0;
  bool converged = false;
};

/// Robust multi-scale point-to-plane registration [Chen & Medioni 1992] of `source` on `target`, from T_init.
/// Too few correspondences: converged = false, overlap what was left.
RegistrationResult register_clouds(const OrientedCloud& target, const OrientedCloud& source, const Pose3& T_init,
                                   const RegistrationConfig& config);

/// At most `count` places where the clouds touch, evenly spread over those of the source that the registration uses.
std::vector<Contact> find_contacts(const OrientedCloud& target, const OrientedCloud& source,
                                   const Pose3& T_target_source, std::size_t count, const RegistrationConfig& config);

/// Point-to-plane residual of every point against the nearest other point that would be a correspondence in
/// register_clouds; NaN where there is none. Noise and rough surfaces leave as much between two clouds of one
/// place, but no more.
std::vector<float> self_residuals(const OrientedCloud& cloud, const RegistrationConfig& config);

}  // namespace tutti::lidar
