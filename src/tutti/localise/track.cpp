// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/track.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::localise {
namespace {

// Odometry errs by this at least, as a share of the distance, and per radian.
constexpr double kDrift = 0.01, kDrift_rad_per_m = 0.2 * kRadPerDeg, kDrift_rad_per_rad = 0.01;
constexpr double kStep_m = 0.002;
// The weight of the newest scan in what is usual. Scans fit worse within seconds where a robot drives into ground that
// has changed, and from one to the next where it was carried.
constexpr double kNewest = 0.1;

/// Odometry may err by this over one step, whatever it states.
Matrix6d least_doubt(const Pose3& step) {
  const double metres = step.translation.norm(), radians = rotation_angle(step);
  return diagonal_covariance(kDrift * metres + kStep_m, kDrift_rad_per_m * metres + kDrift_rad_per_rad * radians);
}

RelativePose carried(const RelativePose& T_world_body, const Pose3& step, const Matrix6d& stated = Matrix6d::Zero()) {
  return {T_world_body.T_a_b * step, compound_covariance(step, T_world_body.covariance, stated + least_doubt(step))};
}

}  // namespace

void RecentOdometry::add(const OdometrySample& sample) {
  poses_.push_back({sample.stamp, sample.T_odom_body});
  steps_.push_back(bounded_covariance(sample.increment_covariance, 1.0, 0.2));
  const auto old =
      std::ranges::find_if(poses_, [&](const StampedPose& pose) { return sample.stamp - pose.stamp <= kKept_s; });
  steps_.erase(steps_.begin(), steps_.begin() + (old - poses_.begin()));
  poses_.erase(poses_.begin(), old);
}

std::optional<OdometrySample> RecentOdometry::newest() const {
  if (poses_.empty()) return std::nullopt;
  return OdometrySample{poses_.back().stamp, poses_.back().pose, steps_.back()};
}

Matrix6d RecentOdometry::stated(Timestamp from, Timestamp to) const {
  Matrix6d sum = Matrix6d::Zero();
  for (std::size_t k = 0; k < poses_.size(); ++k)
    if (poses_[k].stamp > from && poses_[k].stamp <= to) sum += steps_[k];
  return sum;
}

void Track::predict_to(const StampedPose& to, const Matrix6d& stated) {
  T_world_body = carried(T_world_body, at.pose.inverse() * to.pose, stated);
  at = to;
}

void Track::correct(const RelativePose& measured) {
  RelativePose& now = T_world_body;
  const Matrix6d S = now.covariance + measured.covariance;
  const Matrix6d gain = S.ldlt().solve(now.covariance).transpose();
  now.T_a_b = retract(now.T_a_b, gain * local(now.T_a_b, measured.T_a_b));
  const Matrix6d rest = Matrix6d::Identity() - gain;
  now.covariance = rest * now.covariance * rest.transpose() + gain * measured.covariance * gain.transpose();
}

void Track::learn(double quality) {
  usual_quality = usual_quality ? *usual_quality + kNewest * (quality - *usual_quality) : quality;
}

RelativePose Track::carried_to(const Pose3& T_odom_body) const {
  return carried(T_world_body, at.pose.inverse() * T_odom_body);
}

RelativePose carried_to(const Pose3& T_odom_body, const Hypothesis& place) {
  return carried(place.T_world_body, place.at.pose.inverse() * T_odom_body);
}

}  // namespace tutti::localise
