// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/voxel_filter.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <vector>

#include "tutti/base/check.hpp"

namespace tutti::lidar {
namespace {

constexpr double kHalfRange = 1048576.0;  // 2^20 voxels: 21 bits per axis fit one 63-bit Morton code

struct KeyedPoint {
  std::uint64_t key;
  Eigen::Vector3f point;
};

/// Spreads the low 21 bits to every third bit.
std::uint64_t spread_bits(std::uint64_t x) {
  x = (x | (x << 32U)) & 0x1f00000000ffffULL;
  x = (x | (x << 16U)) & 0x1f0000ff0000ffULL;
  x = (x | (x << 8U)) & 0x100f00f00f00f00fULL;
  x = (x | (x << 4U)) & 0x10c30c30c30c30c3ULL;
  return (x | (x << 2U)) & 0x1249249249249249ULL;
}

/// Counted from the far corner of the range.
Eigen::Array3d cell_of(const Eigen::Vector3f& p, double voxel_m) {
  return (p.cast<double>().array() / voxel_m).floor() + kHalfRange;
}

bool is_in_range(const Eigen::Array3d& cell) {
  return (cell >= 0.0).all() && (cell < 2.0 * kHalfRange).all();  // also false for NaN
}

/// Appends the point unless it is not finite or out of range.
void append(std::vector<KeyedPoint>& out, const Eigen::Vector3f& p, double voxel_m) {
  const Eigen::Array3d cell = cell_of(p, voxel_m);
  if (!is_in_range(cell)) return;
  const auto axis = [&](int i) { return spread_bits(static_cast<std::uint64_t>(cell[i])); };
  out.push_back({axis(0) | (axis(1) << 1U) | (axis(2) << 2U), p});
}

PointCloud centroids(std::vector<KeyedPoint> points) {
  // Also ordered within a voxel: the sum, to the bit, must not depend on the order of the input.
  std::sort(points.begin(), points.end(), [](const KeyedPoint& a, const KeyedPoint& b) {
    return std::tie(a.key, a.point.x(), a.point.y(), a.point.z()) <
           std::tie(b.key, b.point.x(), b.point.y(), b.point.z());
  });
  PointCloud out;
  for (std::size_t begin = 0; begin < points.size();) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t end = begin;
    for (; end < points.size() && points[end].key == points[begin].key; ++end) sum += points[end].point.cast<double>();
    out.points.push_back((sum / static_cast<double>(end - begin)).cast<float>());
    begin = end;
  }
  return out;
}

}  // namespace

PointCloud voxel_downsample(const PointCloud& cloud, double voxel_m) {
  TUTTI_CHECK(voxel_m > 0.0, "voxel_m = {}", voxel_m);
  std::vector<KeyedPoint> keyed;
  keyed.reserve(cloud.points.size());
  for (const auto& p : cloud.points) append(keyed, p, voxel_m);
  return centroids(std::move(keyed));
}

const Eigen::Vector3f* first_skipped(const PointCloud& cloud, double voxel_m) {
  TUTTI_CHECK(voxel_m > 0.0, "voxel_m = {}", voxel_m);
  const auto found = std::find_if(cloud.points.begin(), cloud.points.end(),
                                  [&](const Eigen::Vector3f& p) { return !is_in_range(cell_of(p, voxel_m)); });
  return found == cloud.points.end() ? nullptr : &*found;
}

PointCloud merge_scans(std::span<const PosedCloud> scans, double voxel_m, RangeLimits limits) {
  TUTTI_CHECK(voxel_m > 0.0, "voxel_m = {}", voxel_m);
  std::vector<KeyedPoint> keyed;
  for (const auto& scan : scans) {
    if (!scan.cloud) continue;
    const Eigen::Matrix3d R = scan.T_submap_body.rotation.toRotationMatrix();
    for (const auto& p : scan.cloud->points) {
      const double range = p.cast<double>().norm();
      if (!(range >= limits.min_m && range <= limits.max_m)) continue;
      append(keyed, (R * p.cast<double>() + scan.T_submap_body.translation).cast<float>(), voxel_m);
    }
  }
  return centroids(std::move(keyed));
}

}  // namespace tutti::lidar
