// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/scan_step.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "tutti/geometry/so3.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

namespace tutti::fit {
namespace {

constexpr double kVoxel_m = 0.3;
constexpr std::size_t kMostPoints = 6000;
constexpr double kLeastOverlap = 0.4;
constexpr double kMostRmse_m = 0.15;
// Registration of sparse scans errs by this at least: rings of a LiDAR and edges of voxels move with the sensor.
constexpr double kFloor_m = 0.02, kFloor_rad = 0.3 * kRadPerDeg;
// Below this least eigenvalue of the normals' scatter the scans slide (as lidar::LidarClosureConfig has it), however
// sure the residuals are: that much is then unknown along the axis.
constexpr double kSliding = 0.03, kSlides_m = 1.0;
// Two ends of the registration are one when they are this close.
constexpr double kSame_m = 0.05, kSame_rad = 0.5 * kRadPerDeg;
// Share of the best end's quality from which another end is as good.
constexpr double kRivalQuality = 0.9;
// Registration begun this close to an end reaches it.
constexpr double kReach_m = 0.15, kReach_rad = 3.0 * kRadPerDeg;

bool is_near(const Pose3& a, const Pose3& b, double metres, double radians) {
  const Pose3 d = a.inverse() * b;
  return d.translation.norm() <= metres && rotation_angle(d) <= radians;
}

const lidar::RegistrationConfig& registration_config() {
  static const lidar::RegistrationConfig config{.levels = {{1.5, 400, 10}, {0.6, 600, 8}, {0.3, 1000, 8}}};
  return config;
}

bool fits(const lidar::RegistrationResult& r) { return r.overlap >= kLeastOverlap && r.plane_rmse_m <= kMostRmse_m; }

/// How well two scans lie on each other: points in common that are on one surface.
double quality(const lidar::RegistrationResult& r) { return r.overlap * (1.0 - r.plane_rmse_m / kMostRmse_m); }

}  // namespace

FitScan make_fit_scan(Timestamp stamp, const PointCloud& cloud, double min_range_m) {
  PointCloud seen;
  seen.points.reserve(cloud.points.size());
  for (const Eigen::Vector3f& p : cloud.points)
    if (p.norm() >= static_cast<float>(min_range_m)) seen.points.push_back(p);
  std::vector<Eigen::Vector3f> points = lidar::voxel_downsample(seen, kVoxel_m).points;
  if (points.size() > kMostPoints) {
    for (std::size_t k = 0; k < kMostPoints; ++k) points[k] = points[k * points.size() / kMostPoints];
    points.resize(kMostPoints);
  }
  return {stamp, lidar::orient(std::move(points), {}, {})};
}

Matrix6d widened(Matrix6d covariance, const lidar::RegistrationResult& registration, double floor_m, double floor_rad) {
  const Eigen::Vector3d& weakest = registration.weakest_source;
  if (registration.min_translation_eigenvalue < kSliding)
    covariance.topLeftCorner<3, 3>() += kSlides_m * kSlides_m * weakest * weakest.transpose();
  covariance.diagonal().head<3>().array() += floor_m * floor_m;
  covariance.diagonal().tail<3>().array() += floor_rad * floor_rad;
  return covariance;
}

std::optional<Pose3> motion_over(const ScanStep& step, std::span<const StampedPose> odometry, double offset_s,
                                 double max_gap_s) {
  const auto from = pose_at(odometry, step.from + offset_s, max_gap_s);
  const auto to = pose_at(odometry, step.to + offset_s, max_gap_s);
  return from && to ? std::optional(from->inverse() * *to) : std::nullopt;
}

Pose3 steady_motion(const ScanStep& step, double duration_s) {
  const double share = duration_s / (step.to - step.from);
  return {so3_exp(share * so3_log(step.T_from_to.rotation)), share * step.T_from_to.translation};
}

std::optional<ScanStep> step_between(const FitScan& from, const FitScan& to, const Pose3& T_by_odometry,
                                     const Pose3& T_as_before) {
  ScanStep step{.from = from.stamp, .to = to.stamp};
  std::vector<Pose3> begun;
  const auto register_from = [&](const Pose3& T_init) {
    ++step.registrations;
    begun.push_back(T_init);
    return lidar::register_clouds(from.cloud, to.cloud, T_init, registration_config());
  };
  lidar::RegistrationResult best = register_from(T_by_odometry);
  Matrix6d ambiguity = Matrix6d::Zero();
  if (!fits(best) || !is_near(best.T_target_source, T_by_odometry, kReach_m, kReach_rad)) {
    for (const Pose3& T_init : {Pose3{}, T_as_before}) {
      if (std::ranges::any_of(begun, [&](const Pose3& T) { return is_near(T, T_init, kReach_m, kReach_rad); }))
        continue;
      lidar::RegistrationResult other = register_from(T_init);
      if (quality(other) > quality(best)) std::swap(best, other);
      const bool rivals = fits(other) && quality(other) > kRivalQuality * quality(best);
      if (!rivals || is_near(best.T_target_source, other.T_target_source, kSame_m, kSame_rad)) continue;
      const Vector6d d = local(best.T_target_source, other.T_target_source);
      ambiguity = d * d.transpose();
    }
  }
  if (!fits(best)) return std::nullopt;
  step.T_from_to = best.T_target_source;
  step.overlap = best.overlap;
  step.covariance = widened(best.covariance + ambiguity, best, kFloor_m, kFloor_rad);
  return step;
}

}  // namespace tutti::fit
