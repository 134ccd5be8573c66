// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/deskewed_scan.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>
#include <ranges>
#include <utility>
#include <vector>

#include "tutti/perception/lidar/undistort.hpp"

namespace tutti::lidar {
namespace {

/// Poses that go on from the first of a trajectory, away from the others, as these went on for a short time: for as
/// long as a point may be from its pose.
template <class Samples>
Trajectory gone_on(const Samples& samples) {
  constexpr double kShortTime_s = 0.01;
  StampedPose from = *samples.begin();
  const auto far = [&](const StampedPose& other) { return std::abs(other.stamp - from.stamp) >= kShortTime_s; };
  const auto found = std::find_if(samples.begin(), samples.end(), far);
  const StampedPose& other = found == samples.end() ? *std::prev(found) : *found;
  const double step_s =
      std::copysign(std::max(kShortTime_s, std::abs(from.stamp - other.stamp)), from.stamp - other.stamp);
  const Pose3 step = other.pose.inverse() * from.pose;
  Trajectory out;
  for (double reached_s = 0.0; reached_s < kLongestAge_s; reached_s += std::abs(step_s)) {
    from = {from.stamp + step_s, from.pose * step};
    out.push_back(from);
  }
  return out;
}

}  // namespace

Trajectory with_ends(const Trajectory& odometry) {
  Trajectory out = gone_on(odometry);
  std::ranges::reverse(out);
  out.insert(out.end(), odometry.begin(), odometry.end());
  const Trajectory after = gone_on(std::views::reverse(odometry));
  out.insert(out.end(), after.begin(), after.end());
  return out;
}

Result<Scan> deskewed(formats::TimedCloud measured, Timestamp stamp, const std::optional<PointTimes>& times,
                      const Pose3& T_body_lidar, const Trajectory& odometry, double offset_s) {
  Scan scan{.stamp = stamp + offset_s, .cloud = nullptr, .age_s = nullptr};
  if (times) {
    drop_stray_times(measured);
    auto ages = point_ages(measured, stamp, *times);
    if (!ages) return tl::unexpected(ages.error());
    scan.age_s = std::make_shared<const std::vector<float>>(std::move(*ages));
  }
  const Eigen::Matrix3f R_body_lidar = T_body_lidar.rotation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f p_body_lidar = T_body_lidar.translation.cast<float>();
  for (Eigen::Vector3f& point : measured.cloud.points) point = R_body_lidar * point + p_body_lidar;
  scan.cloud = std::make_shared<const PointCloud>(std::move(measured.cloud));
  return lidar::undistort(scan, odometry);
}

}  // namespace tutti::lidar
