// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/triangulate.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

#include "tutti/geometry/rays.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::visual {
namespace {

constexpr int kIterations = 20;
constexpr double kLossSigmas = 2.0;     // scale of Cauchy's loss
constexpr double kUnseenSigmas2 = 1e4;  // squared error of a view that cannot see the point at all
constexpr double kConverged_m = 1e-6;   // relative to the distance

std::optional<Ray> ray_of(const View& view) {
  const auto direction = unproject(*view.camera, view.pixel);
  if (!direction) return std::nullopt;
  const Pose3 T_submap_camera = view.T_camera_submap.inverse();
  return Ray{T_submap_camera.translation, T_submap_camera.rotation * *direction};
}

/// Residual of one view in sigmas, with its Jacobian by the point.
struct Linear {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 3> jacobian;
};
std::optional<Linear> linearise(const View& view, const Eigen::Vector3d& position) {
  Linear out;
  Eigen::Matrix<double, 2, 3> d_pixel_d_point;
  const auto pixel = project(*view.camera, view.T_camera_submap * position, &d_pixel_d_point);
  if (!pixel) return std::nullopt;
  out.residual = (*pixel - view.pixel) / view.sigma_px;
  out.jacobian = d_pixel_d_point * view.T_camera_submap.rotation.toRotationMatrix() / view.sigma_px;
  return out;
}

struct Normal {
  Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  double cost = 0.0;
};
Normal normal_equations(std::span<const View> views, const Eigen::Vector3d& position, bool robust) {
  constexpr double c2 = kLossSigmas * kLossSigmas;
  Normal out;
  for (const View& view : views) {
    const auto linear = linearise(view, position);
    const double s = linear ? std::min(linear->residual.squaredNorm(), kUnseenSigmas2) : kUnseenSigmas2;
    out.cost += robust ? c2 * std::log1p(s / c2) : s;
    if (!linear) continue;
    const double weight = robust ? 1.0 / (1.0 + s / c2) : 1.0;
    out.H += weight * linear->jacobian.transpose() * linear->jacobian;
    out.g += weight * linear->jacobian.transpose() * linear->residual;
  }
  return out;
}

/// Gauss-Newton, with damping where a step would make it worse.
Eigen::Vector3d refine(std::span<const View> views, Eigen::Vector3d position, bool robust) {
  Normal now = normal_equations(views, position, robust);
  double damping = 0.0;
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Matrix3d H = now.H + damping * Eigen::Matrix3d(now.H.diagonal().asDiagonal());
    const Eigen::Vector3d step = -H.ldlt().solve(now.g);
    if (!step.allFinite()) break;
    const Normal next = normal_equations(views, position + step, robust);
    if (next.cost > now.cost) {
      damping = std::max(1e-3, 10.0 * damping);
      continue;
    }
    damping = damping > 1e-3 ? 0.1 * damping : 0.0;
    position += step;
    now = next;
    if (step.norm() < kConverged_m * (1.0 + position.norm())) break;
  }
  return position;
}

std::vector<bool> which_fit(std::span<const View> views, const Eigen::Vector3d& position, double max_px) {
  std::vector<bool> out;
  for (const View& view : views) {
    const auto pixel = project(*view.camera, view.T_camera_submap * position);
    out.push_back(pixel && (*pixel - view.pixel).norm() <= max_px);
  }
  return out;
}

template <class T>
std::vector<T> chosen(std::span<const T> all, const std::vector<bool>& which) {
  std::vector<T> out;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (which[i]) out.push_back(all[i]);
  return out;
}

bool in_front(const Ray& ray, const Eigen::Vector3d& position) {
  return ray.direction.dot(position - ray.origin) > 0.0;
}

}  // namespace

Eigen::Matrix3d point_information(std::span<const View> views, const Eigen::Vector3d& position) {
  return normal_equations(views, position, false).H;
}

tl::expected<TriangulatedPoint, TriangulationFault> triangulate(std::span<const View> all,
                                                                const TriangulationConfig& config) {
  const auto least = static_cast<std::size_t>(config.min_views);
  const double min_parallax = config.min_parallax_deg * kRadPerDeg;
  std::vector<Ray> rays;
  std::vector<bool> has_ray;
  for (const View& view : all) {
    const auto ray = ray_of(view);
    has_ray.push_back(ray.has_value());
    if (ray) rays.push_back(*ray);
  }
  if (rays.size() < least) return tl::unexpected(TriangulationFault::misfit);
  if (largest_angle(rays) < min_parallax) return tl::unexpected(TriangulationFault::parallax);
  const auto start = nearest_point(rays);
  if (!start) return tl::unexpected(TriangulationFault::parallax);
  const auto views = chosen(all, has_ray);

  TriangulatedPoint out;
  out.position = refine(views, *start, true);
  auto fits = which_fit(views, out.position, config.max_reprojection_px);
  auto fitting = chosen<View>(views, fits);
  if (fitting.size() < least) {
    const bool seen = std::ranges::all_of(rays, [&](const Ray& ray) { return in_front(ray, out.position); });
    return tl::unexpected(seen ? TriangulationFault::misfit : TriangulationFault::behind);
  }
  out.position = refine(fitting, out.position, false);
  fits = which_fit(views, out.position, config.max_reprojection_px);
  fitting = chosen<View>(views, fits);
  if (fitting.size() < least) return tl::unexpected(TriangulationFault::misfit);
  const auto fitting_rays = chosen<Ray>(rays, fits);
  if (largest_angle(fitting_rays) < min_parallax) return tl::unexpected(TriangulationFault::parallax);
  if (!std::ranges::all_of(fitting_rays, [&](const Ray& ray) { return in_front(ray, out.position); }))
    return tl::unexpected(TriangulationFault::behind);

  const Normal normal = normal_equations(fitting, out.position, false);
  const double freedom = 2.0 * static_cast<double>(fitting.size()) - 3.0;
  out.covariance = normal.H.inverse() * std::max(1.0, normal.cost / freedom);
  if (!out.position.allFinite() || !out.covariance.allFinite()) return tl::unexpected(TriangulationFault::misfit);
  std::size_t next = 0;
  for (const bool has : has_ray) out.fits.push_back(has && fits[next++]);
  return out;
}

}  // namespace tutti::visual
