// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/visibility.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace tutti::lidar {
namespace {

constexpr int kColumns = 128;
constexpr int kRows = 64;
constexpr float kPixelsPerRad = kColumns / (2.0F * std::numbers::pi_v<float>);
constexpr float kMinDepth = 0.3F;

struct Direction {
  float column, row;  // continuous bin coordinates
};

Direction direction_of(const Eigen::Vector3f& ray) {
  const float azimuth = std::atan2(ray.y(), ray.x());
  const float elevation = std::atan2(ray.z(), std::hypot(ray.x(), ray.y()));
  return {(azimuth + std::numbers::pi_v<float>)*kPixelsPerRad,
          (elevation + 0.5F * std::numbers::pi_v<float>)*kPixelsPerRad};
}

}  // namespace

DepthPanorama::DepthPanorama(const OrientedCloud& cloud, const Eigen::Vector3f& viewpoint, float spacing_m)
    : viewpoint_(viewpoint), depth_cm_(kColumns * kRows, 0) {
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f ray = cloud.point(i) - viewpoint;
    const float depth = ray.norm();
    if (depth < kMinDepth) continue;
    const auto depth_cm = static_cast<std::uint16_t>(std::min(100.0F * depth, 65535.0F));
    const Direction d = direction_of(ray);
    const float reach = 0.5F + 0.7F * spacing_m / depth * kPixelsPerRad;
    const float flat = std::max(0.1F, std::hypot(ray.x(), ray.y()) / depth);  // a column is narrower near the poles
    const int row_begin = std::max(0, static_cast<int>(d.row - reach)),
              row_end = std::min(kRows - 1, static_cast<int>(d.row + reach));
    const int column_begin = static_cast<int>(std::floor(d.column - reach / flat)),
              column_end = static_cast<int>(std::floor(d.column + reach / flat));
    for (int row = row_begin; row <= row_end; ++row)
      for (int column = column_begin; column <= column_end; ++column) {
        std::uint16_t& bin = depth_cm_[row * kColumns + ((column % kColumns + kColumns) % kColumns)];
        if (bin == 0 || depth_cm < bin) bin = depth_cm;
      }
  }
}

float DepthPanorama::depth_towards(const Eigen::Vector3f& point) const {
  const Direction d = direction_of(point - viewpoint_);
  const int row = std::clamp(static_cast<int>(d.row), 0, kRows - 1);
  return 0.01F * static_cast<float>(depth_cm_[row * kColumns + static_cast<int>(d.column) % kColumns]);
}

VisibilityCount count_visible(const std::vector<DepthPanorama>& target_views, const OrientedCloud& source,
                              const Pose3& T_target_source, int max_points, float margin_m) {
  VisibilityCount count;
  const Eigen::Matrix3f R = T_target_source.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_target_source.translation.cast<float>();
  const std::size_t n = source.size(), used = std::min(n, static_cast<std::size_t>(max_points));
  for (std::size_t k = 0; k < used; ++k) {
    const std::size_t i = k * n / used;
    if (source.normal(i) == Eigen::Vector3f::Zero()) continue;
    const Eigen::Vector3f p = R * source.point(i) + t;
    for (const auto& view : target_views) {
      const float depth = view.depth_towards(p), distance = (p - view.viewpoint()).norm();
      if (depth == 0.0F || distance < kMinDepth) continue;
      if (distance < depth - margin_m)
        ++count.contradicting;
      else if (distance < depth + margin_m)
        ++count.seen;
    }
  }
  return count;
}

}  // namespace tutti::lidar
