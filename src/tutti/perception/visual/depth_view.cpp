// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/depth_view.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

namespace tutti::visual {
namespace {

constexpr double kWide = 2.0;  // the depth's share of a view's sigma over the pixel's, at the reference depth
constexpr double kReference_m = 2.0;

/// m, along the optical axis.
double sigma_of(double depth_m, const DepthSensor& sensor) {
  return std::hypot(sensor.sigma_m, sensor.sigma_per_m2 * depth_m * depth_m);
}

/// m; 0: not known.
double depth_of(const DepthImage& depth, int x, int y, const DepthSensor& sensor) {
  return sensor.unit_m * depth.value[static_cast<std::size_t>(y * depth.width_px + x)];
}

/// At the pixel, where those around it are of the same surface.
std::optional<double> depth_at(const DepthImage& depth, const Eigen::Vector2f& pixel, const DepthSensor& sensor) {
  constexpr double kSameSurface = 0.03;  // of the depth, and four sigmas: a slanted surface is no edge
  const auto u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
  if (u < 1 || v < 1 || u + 1 >= depth.width_px || v + 1 >= depth.height_px) return std::nullopt;
  const auto at = [&](int x, int y) { return depth_of(depth, x, y, sensor); };
  const double here = at(u, v);
  if (!(here >= sensor.least_m && here <= sensor.most_m)) return std::nullopt;
  const double allowed = kSameSurface * here + 4.0 * sigma_of(here, sensor);
  for (const auto& [x, y] : {std::pair(u - 1, v), {u + 1, v}, {u, v - 1}, {u, v + 1}})
    if (at(x, y) == 0.0 || std::abs(at(x, y) - here) > allowed) return std::nullopt;
  return here;
}

}  // namespace

Camera depth_camera(const Camera& first, const DepthSensor& sensor, double sigma_px) {
  const CameraModel& model = first.model;
  const double of_ray = std::max(sigma_of(kReference_m, sensor) / (kReference_m * kReference_m), 1e-4);
  const double baseline_m = kWide * sigma_px / (model.fx * of_ray);
  const double widest_px = model.fx * baseline_m / sensor.least_m;
  // A point lies farther left in its image than in the first one's, the more the nearer it is.
  Camera out{{CameraKind::pinhole, model.width_px, model.height_px, model.fx, model.fy, model.cx, model.cy, {}}, {}};
  constexpr double kMargin = 2.0;  // undistorted, corners lie farther out
  out.model.width_px = static_cast<int>(kMargin * model.width_px + widest_px);
  out.model.cx = 0.5 * (kMargin - 1.0) * model.width_px + model.cx + widest_px;
  out.model.height_px = static_cast<int>(kMargin * model.height_px);
  out.model.cy = 0.5 * (kMargin - 1.0) * model.height_px + model.cy;
  out.T_body_camera = first.T_body_camera * Pose3{Eigen::Quaterniond::Identity(), {baseline_m, 0.0, 0.0}};
  return out;
}

Status check_depth_size(const DepthImage& depth, const Camera& first) {
  if (depth.width_px == first.model.width_px && depth.height_px == first.model.height_px) return {};
  return fail(ErrorCode::invalid, "a depth image of {} x {} pixels, its camera has {} x {}", depth.width_px,
              depth.height_px, first.model.width_px, first.model.height_px);
}

TrackedImage view_by_depth(TrackedImage& image, const DepthImage& depth, const DepthSensor& sensor, const Camera& first,
                           const Camera& by_depth, std::uint64_t next_track) {
  TrackedImage out{.camera = 1, .keypoints = {}, .descriptors = {}};
  const Pose3 T_depth_first = by_depth.T_body_camera.inverse() * first.T_body_camera;
  for (TrackedKeypoint& it : image.keypoints) {
    const auto z_m = depth_at(depth, it.pixel, sensor);
    const auto ray = z_m ? unproject(first.model, it.pixel.cast<double>()) : std::nullopt;
    if (!ray || !(ray->z() > 0.0)) continue;
    const auto pixel = project(by_depth.model, T_depth_first * Eigen::Vector3d(*z_m / ray->z() * *ray));
    if (!pixel || !in_image(by_depth.model, *pixel)) continue;
    const double shift_px = by_depth.model.fx * T_depth_first.translation.x() / *z_m;  // its derivative by z: over z
    const double sigma_px = std::hypot(static_cast<double>(it.sigma_px), shift_px * sigma_of(*z_m, sensor) / *z_m);
    if (it.track == 0) it.track = next_track++;
    out.keypoints.push_back({pixel->cast<float>(), static_cast<float>(sigma_px), it.track});
  }
  return out;
}

std::optional<std::string> DepthWatch::add(const DepthImage& depth, const DepthSensor& sensor) {
  if (images_ == kImages) return std::nullopt;
  constexpr int kEvery_px = 8;
  for (int v = 0; v < depth.height_px; v += kEvery_px)
    for (int u = 0; u < depth.width_px; u += kEvery_px) depths_m_.push_back(depth_of(depth, u, v, sensor));
  if (++images_ < kImages) return std::nullopt;
  const auto all = static_cast<double>(depths_m_.size());
  std::erase(depths_m_, 0.0);
  const double known = static_cast<double>(depths_m_.size()) / all;
  if (known < kLeastShare)
    return fmt::format("depth is not known (0) at {:.0f} % of the pixels of the first {} depth images",
                       100.0 * (1.0 - known), images_);
  const auto used =
      std::ranges::count_if(depths_m_, [&](double m) { return sensor.least_m <= m && m <= sensor.most_m; });
  if (static_cast<double>(used) >= kLeastShare * all) return std::nullopt;
  const auto middle = depths_m_.begin() + static_cast<std::ptrdiff_t>(depths_m_.size() / 2);
  std::ranges::nth_element(depths_m_, middle);
  return fmt::format(
      "depth is {:.3g} m in the median of the first {} depth images, and within {} to {} m at {:.0f} % of "
      "their pixels: are there {:g} of their numbers to a metre?",
      *middle, images_, sensor.least_m, sensor.most_m, 100.0 * static_cast<double>(used) / all, 1.0 / sensor.unit_m);
}

}  // namespace tutti::visual
