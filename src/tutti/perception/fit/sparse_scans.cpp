// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/sparse_scans.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace tutti::fit {
namespace {

constexpr double kCube_m = 0.3;
constexpr std::size_t kMostOfScan = 500;
constexpr std::size_t kFewestScans = 8;
constexpr double kLeastMoved_m = 3.0;
// Share of the points that lie on another scan as they are: by so much, and so many times, more than by odometry.
constexpr double kMore = 0.1, kTimes = 1.2;

/// The share of all points whose cube another scan has a point in, too.
double shared(std::span<const lidar::PosedCloud> scans, bool by_odometry) {
  using Cube = std::array<std::int32_t, 3>;
  std::vector<std::pair<Cube, std::size_t>> points;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    const auto& all = scans[s].cloud->points;
    const std::size_t stride = std::max<std::size_t>(1, all.size() / kMostOfScan);
    for (std::size_t i = 0; i < all.size(); i += stride) {
      Eigen::Vector3d p = all[i].cast<double>();
      if (by_odometry) p = scans[s].T_submap_body * p;
      p = (p / kCube_m).array().floor();
      if (!p.allFinite() || p.cwiseAbs().maxCoeff() > 1e6) continue;
      const Eigen::Vector3i at = p.cast<int>();
      points.push_back({{at.x(), at.y(), at.z()}, s});
    }
  }
  std::ranges::sort(points);
  std::size_t in_common = 0;
  for (auto begin = points.begin(); begin != points.end();) {
    const auto end = std::find_if(begin, points.end(), [&](const auto& point) { return point.first != begin->first; });
    if (begin->second != std::prev(end)->second) in_common += static_cast<std::size_t>(end - begin);
    begin = end;
  }
  return points.empty() ? 0.0 : static_cast<double>(in_common) / static_cast<double>(points.size());
}

}  // namespace

double moved_while_still(std::span<const lidar::PosedCloud> scans) {
  if (scans.size() < kFewestScans) return 0.0;
  double distance_m = 0.0;
  for (std::size_t s = 1; s < scans.size(); ++s)
    distance_m += (scans[s].T_submap_body.translation - scans[s - 1].T_submap_body.translation).norm();
  if (distance_m < kLeastMoved_m) return 0.0;
  const double still = shared(scans, false), moved = shared(scans, true);
  return still - moved >= kMore && still >= kTimes * moved ? distance_m : 0.0;
}

}  // namespace tutti::fit
