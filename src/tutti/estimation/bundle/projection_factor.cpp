// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/projection_factor.hpp"

#include <algorithm>

#include "tutti/geometry/so3.hpp"

namespace tutti::bundle {
namespace {

/// Reorders `values`.
double quantile(std::vector<double>& values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

}  // namespace

std::optional<ProjectionLinearisation> linearise_projection(const Camera& camera, const Pose3& T_world_body,
                                                            const Eigen::Vector3d& p_world,
                                                            const Eigen::Vector2d& pixel, double sigma_px) {
  const Eigen::Matrix3d R_body_world = T_world_body.rotation.toRotationMatrix().transpose();
  const Eigen::Matrix3d R_camera_body = camera.T_body_camera.rotation.toRotationMatrix().transpose();
  const Eigen::Vector3d p_body = R_body_world * (p_world - T_world_body.translation);
  const Eigen::Vector3d p_camera = R_camera_body * (p_body - camera.T_body_camera.translation);
  Eigen::Matrix<double, 2, 3> d_pixel;
  const auto seen = project(camera.model, p_camera, &d_pixel);
  if (!seen) return std::nullopt;
  const Eigen::Matrix<double, 2, 3> d_body = d_pixel * R_camera_body / sigma_px;
  ProjectionLinearisation out;
  out.residual = (*seen - pixel) / sigma_px;
  out.J_pose.leftCols<3>() = -d_body;  // p_body moves by -rho + p_body x theta
  out.J_pose.rightCols<3>() = d_body * skew(p_body);
  out.J_landmark = d_body * R_body_world;
  return out;
}

std::optional<Eigen::Vector2d> reprojection_error(const Camera& camera, const Pose3& T_world_body,
                                                  const Eigen::Vector3d& p_world, const Eigen::Vector2d& pixel) {
  const Eigen::Vector3d p_body = T_world_body.rotation.conjugate() * (p_world - T_world_body.translation);
  const auto seen =
      project(camera.model, camera.T_body_camera.rotation.conjugate() * (p_body - camera.T_body_camera.translation));
  if (!seen) return std::nullopt;
  return *seen - pixel;
}

namespace {

std::optional<Eigen::Vector2d> error_of(const BundleProblem& problem, const BundleObservation& view) {
  return reprojection_error(problem.cameras[view.camera].camera, problem.keyframes[view.keyframe].T_world_body,
                            problem.landmarks[view.landmark], view.pixel);
}

}  // namespace

double reprojection_rms_px(const BundleProblem& problem) {
  double sum = 0.0;
  std::size_t seen = 0;
  for (const auto& view : problem.observations)
    if (const auto error = error_of(problem, view)) {
      sum += error->squaredNorm();
      ++seen;
    }
  return seen > 0 ? std::sqrt(sum / static_cast<double>(seen)) : 0.0;
}

std::vector<CameraResiduals> camera_residuals(const BundleProblem& problem) {
  std::vector<CameraResiduals> out;
  std::vector<std::vector<double>> lengths(problem.cameras.size());
  for (const auto& camera : problem.cameras) out.push_back({.robot = camera.robot, .camera = camera.index});
  for (const auto& view : problem.observations) {
    const auto error = error_of(problem, view);
    ++out[view.camera].observations;
    if (error)
      lengths[view.camera].push_back(error->norm());
    else
      ++out[view.camera].unseen;
  }
  for (std::size_t c = 0; c < out.size(); ++c) {
    out[c].median_px = quantile(lengths[c], 0.5);
    out[c].ninetieth_percentile_px = quantile(lengths[c], 0.9);
  }
  return out;
}

}  // namespace tutti::bundle
