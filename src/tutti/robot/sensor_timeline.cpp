// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/sensor_timeline.hpp"

#include <algorithm>
#include <array>

#include "tutti/model/pose_at.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::robot {

std::pair<OdometryStep, OdometryStep> split(const StampedPose& from, const OdometryStep& to, Timestamp at) {
  const double share = (at - from.stamp) / (to.stamp - from.stamp);
  const Pose3 middle = interpolate(from.pose, to.T_odom_body, share);
  // compound_covariance(B, C_1, C_2) = Ad(B)^-1 C_1 Ad(B)^-T + C_2, with B the motion of the second part.
  const Matrix6d ad = adjoint(middle.inverse() * to.T_odom_body);
  const Matrix6d first = share * (ad * to.covariance * ad.transpose());
  return {{at, middle, 0.5 * (first + first.transpose()), to.is_jump},
          {to.stamp, to.T_odom_body, (1.0 - share) * to.covariance, to.is_jump}};
}

OdometryStep joined(const OdometryStep& first, const OdometryStep& second) {
  const Matrix6d both =
      compound_covariance(first.T_odom_body.inverse() * second.T_odom_body, first.covariance, second.covariance);
  return {second.stamp, second.T_odom_body, 0.5 * (both + both.transpose()), false};
}

void SensorTimeline::add(const OdometryStep& step) {
  const bool is_motion = !step.is_jump && (odometry.empty() || !odometry.back().is_jump);
  if (is_motion && odometry.size() >= 2 && step.stamp - odometry[odometry.size() - 2].stamp < kFinest_s) {
    odometry.back() = joined(odometry.back(), step);
    return;
  }
  odometry.push_back(step);
}

void SensorTimeline::add(SensorSample sample) {
  const auto at = std::ranges::lower_bound(sensors, sample.stamp, {}, &SensorSample::stamp);
  if (at == sensors.end() || at->stamp != sample.stamp) {
    sensors.insert(at, std::move(sample));
    return;
  }
  if (sample.scan) at->scan = std::move(sample.scan);
  if (sample.images) at->images = std::move(sample.images);
}

std::optional<Pose3> SensorTimeline::pose_at(const StampedPose& last, Timestamp at) const {
  if (at == last.stamp) return last.pose;
  const auto after = std::ranges::lower_bound(odometry, at, {}, &OdometryStep::stamp);
  if (after == odometry.end()) return std::nullopt;
  if (after->stamp == at) return after->T_odom_body;
  const StampedPose before =
      after == odometry.begin() ? last : StampedPose{std::prev(after)->stamp, std::prev(after)->T_odom_body};
  return tutti::pose_at(std::array{before, StampedPose{after->stamp, after->T_odom_body}}, at);
}

std::optional<SensorTimeline::Instant> SensorTimeline::take(const StampedPose& last, Timestamp until) {
  if (odometry.empty()) return std::nullopt;
  OdometryStep& next = odometry.front();
  const bool is_between = !sensors.empty() && sensors.front().stamp < next.stamp;
  if ((is_between ? sensors.front().stamp : next.stamp) > until) return std::nullopt;
  Instant out;
  if (is_between) {
    auto [first, second] = split(last, next, sensors.front().stamp);
    out.step = first;
    next = second;
  } else {
    out.step = next;
    odometry.pop_front();
  }
  if (!sensors.empty() && sensors.front().stamp == out.step.stamp) {
    out.sensors = std::move(sensors.front());
    sensors.erase(sensors.begin());
  }
  return out;
}

}  // namespace tutti::robot
