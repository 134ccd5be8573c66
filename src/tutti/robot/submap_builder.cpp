// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/submap_builder.hpp"

#include <cmath>
#include <utility>

#include "tutti/geometry/so3.hpp"
#include "tutti/perception/lidar/undistort.hpp"

namespace tutti::robot {
namespace {

Status check_sample(RobotId robot, Timestamp stamp, const Pose3& T_odom_body, const Matrix6d& covariance) {
  if (!is_valid(T_odom_body, 1e-3))
    return fail(ErrorCode::invalid, "robot {}: odometry at {} ns is not a pose (|q| = {}, expected finite and 1)",
                robot.value, stamp.ns, T_odom_body.rotation.norm());
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() < 0.0)
    return fail(ErrorCode::invalid, "robot {}: odometry covariance at {} ns is not finite and non-negative",
                robot.value, stamp.ns);
  return {};
}

}  // namespace

SubmapBuilder::SubmapBuilder(RobotId robot, const SubmapConfig& config) : robot_(robot), config_(config) {}

bool SubmapBuilder::is_keyframe(Timestamp stamp, const Pose3& T_odom_body) const {
  if (keyframes_.empty()) return true;
  const Keyframe& last = keyframes_.back();
  const Pose3 step = last.T_odom_body.inverse() * T_odom_body;
  return step.translation.norm() >= config_.keyframe_distance_m ||
         rotation_angle(step) >= config_.keyframe_angle_deg * kRadPerDeg ||
         stamp - last.stamp >= config_.keyframe_time_s;
}

/// Keeps what is newer than the longest sweep's begin, and one sample before it.
void SubmapBuilder::remember(Timestamp stamp, const Pose3& T_odom_body) {
  recent_.push_back({stamp, T_odom_body});
  std::size_t old = 0;
  while (old + 1 < recent_.size() && stamp - recent_[old + 1].stamp >= kSweepHistoryS) ++old;
  recent_.erase(recent_.begin(), recent_.begin() + static_cast<std::ptrdiff_t>(old));
}

Result<std::optional<Keyframe>> SubmapBuilder::add_odometry(Timestamp stamp, const Pose3& T_odom_body,
                                                            const Matrix6d& increment_covariance) {
  if (auto ok = check_sample(robot_, stamp, T_odom_body, increment_covariance); !ok) return tl::unexpected(ok.error());
  if (!recent_.empty()) {
    const StampedPose& last = recent_.back();
    if (stamp <= last.stamp)
      return fail(ErrorCode::invalid, "robot {}: odometry stamp {} ns does not follow {} ns", robot_.value, stamp.ns,
                  last.stamp.ns);
    const Pose3 step = last.pose.inverse() * T_odom_body;
    distance_ += step.translation.norm();
    since_keyframe_ = {since_keyframe_.T_a_b * step,
                       compound_covariance(step, since_keyframe_.covariance, increment_covariance)};
  }
  remember(stamp, T_odom_body);
  if (!is_keyframe(stamp, T_odom_body)) return std::optional<Keyframe>{};

  const bool first = keyframes_.empty();
  Keyframe keyframe{first ? 0 : keyframes_.back().index + 1, stamp, T_odom_body};
  if (first || distance_ - representative_distance_ >= config_.representative_distance_m) {
    keyframe.representative = true;
    representative_distance_ = distance_;
  }
  if (first) {
    start_submap(keyframe);
    return std::optional(keyframe);
  }
  keyframes_.push_back(keyframe);
  odometry_.push_back(since_keyframe_);
  since_keyframe_ = {.T_a_b = {}, .covariance = Matrix6d::Zero()};
  if (keyframe.stamp - keyframes_.front().stamp >= config_.duration_s) {
    finished_ = close_submap();
    start_submap(keyframe);
  }
  return std::optional(keyframe);
}

Status SubmapBuilder::add_scan(const Scan& scan) {
  if (recent_.empty() || scan.stamp != recent_.back().stamp)
    return fail(ErrorCode::invalid, "robot {}: scan at {} ns has no odometry at its stamp (latest: {} ns)",
                robot_.value, scan.stamp.ns, recent_.empty() ? 0 : recent_.back().stamp.ns);
  if (!scan.cloud || scan.cloud->points.empty())
    return fail(ErrorCode::invalid, "robot {}: scan at {} ns is empty", robot_.value, scan.stamp.ns);
  const auto undistorted = lidar::undistort(scan, recent_);
  if (!undistorted) return fail(ErrorCode::invalid, "robot {}: {}", robot_.value, undistorted.error().message);
  scans_.push_back({keyframes_.front().T_odom_body.inverse() * recent_.back().pose, undistorted->cloud});
  return {};
}

void SubmapBuilder::start_submap(const Keyframe& first) {
  keyframes_ = {first};
  odometry_.clear();
  scans_.clear();
}

Submap SubmapBuilder::close_submap() {
  Submap submap{.id = {robot_, next_submap_++}, .keyframes = keyframes_, .odometry = odometry_};
  if (!scans_.empty())
    submap.cloud = std::make_shared<const PointCloud>(
        lidar::merge_scans(scans_, config_.voxel_m, {config_.min_range_m, config_.max_range_m}));
  return submap;
}

std::optional<Submap> SubmapBuilder::take_submap() { return std::exchange(finished_, std::nullopt); }

std::optional<Submap> SubmapBuilder::finish() {
  if (keyframes_.size() < 2) return std::nullopt;
  Submap last = close_submap();
  start_submap(keyframes_.back());
  return last;
}

}  // namespace tutti::robot
