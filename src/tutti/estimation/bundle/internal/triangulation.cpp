// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/internal/triangulation.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "tutti/estimation/bundle/projection_factor.hpp"
#include "tutti/geometry/rays.hpp"

namespace tutti::bundle::internal {
namespace {

constexpr int kIterations = 5;

Pose3 T_world_camera(const BundleProblem& problem, const BundleObservation& view) {
  return problem.keyframes[view.keyframe].T_world_body * problem.cameras[view.camera].camera.T_body_camera;
}

double cost(const BundleProblem& problem, std::span<const BundleObservation> views, const Eigen::Vector3d& point,
            double max_px) {
  double sum = 0.0;
  for (const auto& view : views) {
    const double error = std::min(error_px(problem, view, point), max_px);
    sum += error * error;
  }
  return sum;
}

std::optional<Eigen::Vector3d> where_rays_meet(const BundleProblem& problem, std::span<const BundleObservation> views) {
  std::vector<Ray> rays;
  for (const auto& view : views) {
    const auto direction = unproject(problem.cameras[view.camera].camera.model, view.pixel);
    if (!direction) continue;
    const Pose3 T = T_world_camera(problem, view);
    rays.push_back({T.translation, T.rotation * *direction});
  }
  return nearest_point(rays);
}

Eigen::Vector3d gauss_newton_step(const BundleProblem& problem, std::span<const BundleObservation> views,
                                  const Eigen::Vector3d& point, double max_px) {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const auto& view : views) {
    const auto at = linearise_projection(problem.cameras[view.camera].camera,
                                         problem.keyframes[view.keyframe].T_world_body, point, view.pixel, 1.0);
    if (!at || at->residual.norm() > max_px) continue;
    H += at->J_landmark.transpose() * at->J_landmark;
    b -= at->J_landmark.transpose() * at->residual;
  }
  const Eigen::LLT<Eigen::Matrix3d> llt(H);
  if (llt.info() != Eigen::Success) return Eigen::Vector3d::Zero();
  return llt.solve(b);
}

}  // namespace

double error_px(const BundleProblem& problem, const BundleObservation& view, const Eigen::Vector3d& point) {
  const auto error = reprojection_error(problem.cameras[view.camera].camera,
                                        problem.keyframes[view.keyframe].T_world_body, point, view.pixel);
  return error ? error->norm() : std::numeric_limits<double>::infinity();
}

double parallax(const BundleProblem& problem, std::span<const BundleObservation> views, const Eigen::Vector3d& point) {
  std::vector<Ray> rays;
  for (const auto& view : views) {
    const Eigen::Vector3d origin = T_world_camera(problem, view).translation;
    rays.push_back({origin, (point - origin).normalized()});
  }
  return largest_angle(rays);
}

std::optional<Eigen::Vector3d> triangulate(const BundleProblem& problem, std::span<const BundleObservation> views,
                                           std::span<const Eigen::Vector3d> starts, double max_px) {
  std::optional<Eigen::Vector3d> best = where_rays_meet(problem, views);
  double best_cost = best ? cost(problem, views, *best, max_px) : std::numeric_limits<double>::infinity();
  const auto consider = [&](const Eigen::Vector3d& point) {
    const double of_point = cost(problem, views, point, max_px);
    if (!(of_point < best_cost)) return false;
    best = point;
    best_cost = of_point;
    return true;
  };
  for (const auto& start : starts) consider(start);
  if (!best) return std::nullopt;
  for (int i = 0; i < kIterations; ++i)
    if (!consider(*best + gauss_newton_step(problem, views, *best, max_px))) break;
  return best;
}

}  // namespace tutti::bundle::internal
