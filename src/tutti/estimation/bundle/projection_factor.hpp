// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/estimation/bundle/bundle_problem.hpp"

namespace tutti::bundle {

/// Reprojection error of a landmark, 2x1, in standard deviations of the pixel:
///   r = (project(T_camera_body T_body_world p_world) - pixel) / sigma
/// with its derivatives for T_world_body <- retract(T_world_body, xi) and p_world <- p_world + d.
struct ProjectionLinearisation {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> J_pose;
  Eigen::Matrix<double, 2, 3> J_landmark;
};
/// No value when no pixel sees the landmark (project() in geometry/camera.hpp).
std::optional<ProjectionLinearisation> linearise_projection(const Camera& camera, const Pose3& T_world_body,
                                                            const Eigen::Vector3d& p_world,
                                                            const Eigen::Vector2d& pixel, double sigma_px);

/// Projected minus measured pixel, px; no value when no pixel sees the landmark.
std::optional<Eigen::Vector2d> reprojection_error(const Camera& camera, const Pose3& T_world_body,
                                                  const Eigen::Vector3d& p_world, const Eigen::Vector2d& pixel);

/// Statistics of the problem's reprojection errors, per entry of problem.cameras.
std::vector<CameraResiduals> camera_residuals(const BundleProblem& problem);

/// Root mean square of the lengths of the problem's reprojection errors, px, over the observations that have one; 0
/// without any.
double reprojection_rms_px(const BundleProblem& problem);

}  // namespace tutti::bundle
