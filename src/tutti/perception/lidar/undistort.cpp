// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/undistort.hpp"

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "tutti/model/pose_at.hpp"

namespace tutti::lidar {
namespace {

Status check_sweep(const Scan& scan, std::span<const StampedPose> samples) {
  if (!scan.cloud) return fail(ErrorCode::invalid, "scan at {} ns has no cloud", scan.stamp.ns);
  if (!scan.age_s) return {};
  const std::vector<float>& ages = *scan.age_s;
  if (ages.size() != scan.cloud->points.size())
    return fail(ErrorCode::invalid, "scan at {} ns: {} ages for {} points", scan.stamp.ns, ages.size(),
                scan.cloud->points.size());
  if (ages.empty()) return {};
  if (samples.empty() || samples.back().stamp < scan.stamp)
    return fail(ErrorCode::invalid, "scan at {} ns: odometry ends before it", scan.stamp.ns);
  const double known_s = scan.stamp - samples.front().stamp, ahead_s = scan.stamp - samples.back().stamp;
  for (std::size_t i = 0; i < ages.size(); ++i)
    if (!(ages[i] >= ahead_s && ages[i] <= known_s))  // also NaN
      return fail(ErrorCode::invalid, "scan at {} ns: point {} is {} s old, expected {} to {} s, the known odometry",
                  scan.stamp.ns, i, ages[i], ahead_s, known_s);
  return {};
}

}  // namespace

Result<Scan> undistort(const Scan& scan, std::span<const StampedPose> T_odom_body) {
  if (auto ok = check_sweep(scan, T_odom_body); !ok) return tl::unexpected(ok.error());
  if (!scan.age_s || scan.age_s->empty()) return Scan{scan.stamp, scan.cloud, nullptr};
  const Pose3 T_end_odom = pose_at(T_odom_body, scan.stamp)->inverse();
  auto cloud = std::make_shared<PointCloud>();
  cloud->points.reserve(scan.cloud->points.size());
  // All beams fire together, so many points in a row share their age.
  float age_s = 0.0F;
  Eigen::Matrix3f R_end_then = Eigen::Matrix3f::Identity();
  Eigen::Vector3f t_end_then = Eigen::Vector3f::Zero();
  for (std::size_t i = 0; i < scan.cloud->points.size(); ++i) {
    if ((*scan.age_s)[i] != age_s) {
      age_s = (*scan.age_s)[i];
      const Timestamp then =
          std::clamp(scan.stamp - double{age_s}, T_odom_body.front().stamp, T_odom_body.back().stamp);
      const Pose3 T_end_then = T_end_odom * *pose_at(T_odom_body, then);
      R_end_then = T_end_then.rotation.toRotationMatrix().cast<float>();
      t_end_then = T_end_then.translation.cast<float>();
    }
    cloud->points.push_back(R_end_then * scan.cloud->points[i] + t_end_then);
  }
  return Scan{scan.stamp, std::move(cloud), nullptr};
}

}  // namespace tutti::lidar
