// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/estimation/imu_preintegration.hpp"
#include "tutti/robot/mend_submap.hpp"
#include "tutti/robot/submap_builder.hpp"

/// A submap that has ended is given what its sensors saw.
namespace tutti::robot {
namespace {

/// Preintegrates the IMU from keyframe to keyframe, where it covers that time, at the gyro bias that the odometry
/// shows.
std::vector<ImuPreintegration> imu_steps(const Submap& submap, const std::vector<TrackedImages>& images) {
  std::vector<ImuSample> samples;
  for (std::size_t i = 1; i < images.size(); ++i)
    for (const ImuSample& sample : images[i].imu)
      if (samples.empty() || samples.back().stamp < sample.stamp) samples.push_back(sample);
  std::vector<ImuPreintegration> out;
  const auto gyro_bias = estimation::estimate_gyro_bias(samples, submap.keyframes);
  if (!gyro_bias) return out;
  for (std::size_t k = 0; k + 1 < submap.keyframes.size(); ++k)
    if (auto step = estimation::preintegrate(samples, submap.keyframes[k], submap.keyframes[k + 1],
                                             {.gyro = *gyro_bias}, images.front().imu_noise))
      out.push_back(std::move(*step));
  return out;
}

/// The visual payload of the submap.
Result<VisualPayload> see(const Submap& submap, const std::vector<TrackedImages>& images,
                          const visual::VisualSubmapConfig& config) {
  std::vector<visual::KeyframeImages> seen;
  std::vector<Vector6d> drift{Vector6d::Zero()};  // variances since the submap's begin
  for (const RelativePose& step : submap.odometry) drift.push_back(drift.back() + step.covariance.diagonal());
  for (const TrackedImages& instant : images) {
    const auto keyframe = std::ranges::find(submap.keyframes, instant.stamp, &Keyframe::stamp);
    TUTTI_CHECK(keyframe != submap.keyframes.end(), "images at {} ns of no keyframe", instant.stamp.ns);
    const Vector6d& variance = drift[static_cast<std::size_t>(keyframe - submap.keyframes.begin())];
    seen.push_back({keyframe->index, submap.keyframes.front().T_odom_body.inverse() * keyframe->T_odom_body,
                    instant.images, variance.tail<3>().mean(), variance.head<3>().mean()});
  }
  auto payload = visual::make_visual_payload(seen, *images.front().cameras, config);
  if (!payload) return in_context("images of submap " + to_string(submap.id), payload.error());
  if (config.send_imu) payload->imu = imu_steps(submap, images);
  return payload;
}

}  // namespace

/// Compares what a finished submap's sensors show with odometry, and mends it.
void SubmapBuilder::fit(FinishedSubmap& finished, const ObserveScans& observe) {
  SubmapSteps steps;
  if (config_.fit.scans != "off") steps = steps_of(finished, config_.min_range_m);
  if (steps.far) state_.drift.add(*steps.far, steps.T_far_by_odometry, steps.far_distance_m, steps.other_rad2);
  if (observe) observe(finished, steps);
  const bool was_mended = state_.T_mended_odom != Pose3{};
  if (was_mended)
    for (Keyframe& keyframe : finished.submap.keyframes)
      keyframe.T_odom_body = state_.T_mended_odom * keyframe.T_odom_body;
  if (config_.fit.scans == "off" || config_.fit.scans == "say") return;
  if (const auto mended = mend(steps, state_.drift.to_take_out(), finished))
    state_.T_mended_odom = *mended * state_.T_mended_odom;
}

std::optional<Submap> SubmapBuilder::take_submap(const ObserveScans& observe) {
  if (state_.finished.empty() || state_.finished.front().awaits_images) return std::nullopt;
  FinishedSubmap next = std::move(state_.finished.front());
  state_.finished.erase(state_.finished.begin());
  fit(next, observe);
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

}  // namespace tutti::robot
