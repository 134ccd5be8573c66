// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/submap_builder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/estimation/bundle/imu_preintegration.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/way.hpp"
#include "tutti/perception/lidar/undistort.hpp"

namespace tutti::robot {
namespace {

Status check_sample(RobotId robot, Timestamp stamp, const Pose3& T_odom_body, const Matrix6d& covariance) {
  if (!is_valid(T_odom_body))
    return fail(ErrorCode::invalid, "robot {}: odometry at {} ns is not a pose (|q| = {}, expected finite and 1)",
                robot.value, stamp.ns, T_odom_body.rotation.norm());
  if (const double largest = T_odom_body.translation.cwiseAbs().maxCoeff(); largest > kMaxCoordinate_m)
    return fail(ErrorCode::invalid, "robot {}: odometry at {} ns has a coordinate of {} m, at most {:.0f} m",
                robot.value, stamp.ns, largest, kMaxCoordinate_m);
  if (auto ok = check_covariance(covariance); !ok)
    return in_context(fmt::format("robot {}: odometry at {} ns", robot.value, stamp.ns), ok.error());
  return {};
}

/// What the IMU measured from keyframe to keyframe, where it covers that time, at the gyro bias that the odometry
/// shows.
std::vector<ImuPreintegration> imu_steps(const Submap& submap, const std::vector<TrackedImages>& images) {
  std::vector<ImuSample> samples;
  for (std::size_t i = 1; i < images.size(); ++i)
    for (const ImuSample& sample : images[i].imu)
      if (samples.empty() || samples.back().stamp < sample.stamp) samples.push_back(sample);
  std::vector<ImuPreintegration> out;
  const auto gyro_bias = bundle::estimate_gyro_bias(samples, submap.keyframes);
  if (!gyro_bias) return out;
  for (std::size_t k = 0; k + 1 < submap.keyframes.size(); ++k)
    if (auto step = bundle::preintegrate(samples, submap.keyframes[k], submap.keyframes[k + 1], {.gyro = *gyro_bias},
                                         images.front().imu_noise))
      out.push_back(std::move(*step));
  return out;
}

/// What the cameras saw along the submap.
Result<VisualPayload> see(const Submap& submap, const std::vector<TrackedImages>& images,
                          const visual::VisualSubmapConfig& config) {
  std::vector<visual::KeyframeImages> seen;
  std::vector<Vector6d> drift{Vector6d::Zero()};  // variances since the submap's begin
  for (const RelativePose& step : submap.odometry) drift.push_back(drift.back() + step.covariance.diagonal());
  for (const TrackedImages& moment : images) {
    const auto keyframe = std::ranges::find(submap.keyframes, moment.stamp, &Keyframe::stamp);
    TUTTI_CHECK(keyframe != submap.keyframes.end(), "images at {} ns of no keyframe", moment.stamp.ns);
    const Vector6d& variance = drift[static_cast<std::size_t>(keyframe - submap.keyframes.begin())];
    seen.push_back({keyframe->index, submap.keyframes.front().T_odom_body.inverse() * keyframe->T_odom_body,
                    moment.images, variance.tail<3>().mean(), variance.head<3>().mean()});
  }
  auto payload = visual::make_visual_payload(seen, *images.front().cameras, config);
  if (!payload) return in_context("images of submap " + to_string(submap.id), payload.error());
  payload->imu = imu_steps(submap, images);
  return payload;
}

}  // namespace

SubmapBuilder::SubmapBuilder(const ChainId& chain, const SubmapConfig& config, SubmapBuilderState state)
    : chain_(chain), config_(config), state_(std::move(state)) {}

bool SubmapBuilder::is_keyframe(Timestamp stamp, const Pose3& T_odom_body) const {
  if (state_.keyframes.empty()) return true;
  const Keyframe& last = state_.keyframes.back();
  const Pose3 step = last.T_odom_body.inverse() * T_odom_body;
  return step.translation.norm() >= config_.keyframe_distance_m ||
         rotation_angle(step) >= config_.keyframe_angle_deg * kRadPerDeg ||
         stamp - last.stamp >= config_.keyframe_time_s;
}

/// Keeps what is newer than the longest sweep's begin, and one sample before it.
void SubmapBuilder::remember(Timestamp stamp, const Pose3& T_odom_body) {
  state_.recent.push_back({stamp, T_odom_body});
  std::size_t old = 0;
  while (old + 1 < state_.recent.size() && stamp - state_.recent[old + 1].stamp >= kSweepHistoryS) ++old;
  state_.recent.erase(state_.recent.begin(), state_.recent.begin() + static_cast<std::ptrdiff_t>(old));
}

Result<std::optional<KeyframeStep>> SubmapBuilder::add_odometry(Timestamp stamp, const Pose3& T_odom_body,
                                                                const Matrix6d& increment_covariance) {
  if (auto ok = check_sample(chain_.robot, stamp, T_odom_body, increment_covariance); !ok)
    return tl::unexpected(ok.error());
  if (!state_.recent.empty()) {
    const StampedPose& last = state_.recent.back();
    if (stamp <= last.stamp)
      return fail(ErrorCode::invalid, "robot {}: odometry stamp {} ns does not follow {} ns", chain_.robot.value,
                  stamp.ns, last.stamp.ns);
    const Pose3 step = last.pose.inverse() * T_odom_body;
    state_.distance_m += step.translation.norm();
    state_.since_keyframe = compound(state_.since_keyframe, {step, increment_covariance});
  }
  remember(stamp, T_odom_body);
  if (!state_.finished.empty()) state_.finished.back().awaits_images = false;
  if (!is_keyframe(stamp, T_odom_body)) return std::optional<KeyframeStep>{};

  const bool first = state_.keyframes.empty();
  Keyframe keyframe{first ? 0 : state_.keyframes.back().index + 1, stamp, T_odom_body};
  if (first || state_.distance_m - state_.representative_distance_m >= config_.representative_distance_m) {
    keyframe.representative = true;
    state_.representative_distance_m = state_.distance_m;
  }
  if (first) {
    start_submap(keyframe);
    return std::optional(KeyframeStep{keyframe});
  }
  const KeyframeStep out{keyframe, std::exchange(state_.since_keyframe, KeyframeStep{}.odometry)};
  state_.keyframes.push_back(keyframe);
  state_.odometry.push_back(out.odometry);
  if (is_full()) {
    close_submap();
    state_.finished.back().awaits_images = !state_.finished.back().images.empty();
    start_submap(keyframe);
  }
  return std::optional(out);
}

Status SubmapBuilder::add_scan(const Scan& scan) {
  if (state_.recent.empty() || scan.stamp != state_.recent.back().stamp)
    return fail(ErrorCode::invalid, "robot {}: scan at {} ns has no odometry at its stamp (latest: {} ns)",
                chain_.robot.value, scan.stamp.ns, state_.recent.empty() ? 0 : state_.recent.back().stamp.ns);
  if (!scan.cloud || scan.cloud->points.empty())
    return fail(ErrorCode::invalid, "robot {}: scan at {} ns is empty", chain_.robot.value, scan.stamp.ns);
  const auto undistorted = lidar::undistort(scan, state_.recent);
  if (!undistorted) return fail(ErrorCode::invalid, "robot {}: {}", chain_.robot.value, undistorted.error().message);
  state_.scans.push_back(
      {state_.keyframes.front().T_odom_body.inverse() * state_.recent.back().pose, undistorted->cloud});
  return {};
}

Status SubmapBuilder::add_images(const TrackedImages& images) {
  const auto where = [&] { return fmt::format("robot {}: images at {} ns", chain_.robot.value, images.stamp.ns); };
  if (!wants_scan() || images.stamp != state_.recent.back().stamp)
    return fail(ErrorCode::invalid, "{}: no keyframe has their stamp (latest sample: {} ns)", where(),
                state_.recent.empty() ? 0 : state_.recent.back().stamp.ns);
  if (auto ok = check_images(images); !ok) return in_context(where(), ok.error());
  if (!state_.images.empty() && *state_.images.back().cameras != *images.cameras)
    return fail(ErrorCode::invalid, "{}: other cameras than those of the images before", where());
  if (!state_.images.empty() && state_.images.back().stamp == images.stamp)
    return fail(ErrorCode::invalid, "{}: there are some already", where());
  state_.images.push_back(images);
  // The keyframe that two submaps share shows both the same.
  if (!state_.finished.empty() && state_.finished.back().awaits_images) {
    state_.finished.back().images.push_back(images);
    state_.finished.back().awaits_images = false;
  }
  return {};
}

void SubmapBuilder::start_submap(const Keyframe& first) {
  state_.keyframes = {first};
  state_.odometry.clear();
  state_.scans.clear();
  state_.images.clear();
}

/// Travel is counted between keyframes: from sample to sample, noise alone would add up to metres.
bool SubmapBuilder::is_full() const {
  return state_.keyframes.back().stamp - state_.keyframes.front().stamp >= config_.duration_s ||
         way_m(state_.odometry) >= config_.distance_m;
}

void SubmapBuilder::close_submap() {
  state_.finished.push_back(
      {{.id = {chain_, state_.next_submap++}, .keyframes = state_.keyframes, .odometry = state_.odometry},
       std::move(state_.scans),
       std::move(state_.images)});
}

std::optional<Submap> SubmapBuilder::take_submap() {
  if (state_.finished.empty() || state_.finished.front().awaits_images) return std::nullopt;
  FinishedSubmap next = std::move(state_.finished.front());
  state_.finished.erase(state_.finished.begin());
  if (!next.scans.empty())
    next.submap.cloud = std::make_shared<const PointCloud>(
        lidar::merge_scans(next.scans, config_.voxel_m, {config_.min_range_m, config_.max_range_m}));
  if (!next.images.empty()) {
    auto payload = see(next.submap, next.images, config_.visual);
    if (payload)
      next.submap.visual = std::make_shared<const VisualPayload>(std::move(*payload));
    else
      image_errors_.push_back(std::move(payload.error()));
  }
  return std::move(next.submap);
}

void SubmapBuilder::finish() {
  if (state_.keyframes.size() < 2) return;
  close_submap();
  start_submap(state_.keyframes.back());
}

}  // namespace tutti::robot
