// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/drive/replay.hpp"

#include <algorithm>
#include <limits>

namespace tutti::drive {

robot::AgentConfig with_sensors(robot::AgentConfig config, const Recording& recording) {
  config.submap.has_scans = recording.scans != nullptr;
  config.submap.has_images = recording.visual != nullptr;
  return config;
}

std::size_t heard_samples(const Recording& recording, const robot::RobotAgent& agent) {
  const auto newest = agent.newest_sample();
  if (!newest) return 0;
  const auto next = std::ranges::upper_bound(recording.odometry, *newest, {}, &StampedPose::stamp);
  return static_cast<std::size_t>(next - recording.odometry.begin());
}

Replay::Replay(const Recording& recording, double start_s, Driver& driver)
    : recording_(recording),
      start_s_(start_s),
      driver_(driver),
      next_(heard_samples(recording, driver.node().agent())) {
  const auto settled = driver.node().agent().settled();
  if (!settled) return;
  const auto skip = [&](const std::vector<Timestamp>& stamps, std::size_t& first) {
    for (auto stamp = stamp_at(recording, stamps, first); stamp && *stamp < *settled;
         stamp = stamp_at(recording, stamps, first))
      ++first;
  };
  skip(recording.scan_stamps, next_scan_);
  skip(recording.image_stamps, next_images_);
  const auto first = std::ranges::lower_bound(recording.measured, *settled, {}, stamp_of);
  next_measured_ = static_cast<std::size_t>(first - recording.measured.begin());
}

/// Nobody may have stored what sensors saw since all was settled, nor the end of the recording.
void Replay::resume(Timestamp now) {
  driver_.resume(now);
  if (next_ == 0) return;
  feed_sensors(now);
  end_if_over(now);
}

double Replay::next_time() const {
  const Trajectory& odometry = recording_.odometry;
  if (next_ >= odometry.size()) return std::numeric_limits<double>::infinity();
  return start_s_ + (odometry[next_].stamp - odometry.front().stamp);
}

OdometrySample Replay::next_sample() const {
  OdometrySample sample{recording_.odometry[next_].stamp, recording_.odometry[next_].pose};
  if (next_ > 0) sample.increment_covariance = recording_.increment_covariance[next_ - 1];
  return sample;
}

void Replay::feed_next(Timestamp now) {
  driver_.add(next_sample(), now);
  ++next_;
  feed_sensors(now);
  end_if_over(now);
}

void Replay::end_if_over(Timestamp now) {
  if (next_ == recording_.odometry.size()) driver_.finish(now);
}

/// From the first odometry sample on, up to the last one that was fed.
void Replay::feed_sensors(Timestamp now) {
  const Timestamp begin = recording_.odometry.front().stamp, end = recording_.odometry[next_ - 1].stamp;
  for (; next_measured_ < recording_.measured.size(); ++next_measured_) {
    const Input& sample = recording_.measured[next_measured_];
    if (stamp_of(sample) > end) break;
    if (stamp_of(sample) >= begin) driver_.add(sample, now);
  }
  sensor_keyframes_.clear();
  while (true) {
    const auto scan = recording_.scans ? stamp_at(recording_, recording_.scan_stamps, next_scan_) : std::nullopt;
    const auto images = recording_.visual ? stamp_at(recording_, recording_.image_stamps, next_images_) : std::nullopt;
    const Timestamp stamp = std::min(scan.value_or(kLastTimestamp), images.value_or(kLastTimestamp));
    if (stamp > end) return;
    if (stamp >= begin) {
      if (scan == stamp) feed_scan(stamp, now);
      if (images == stamp) feed_images(stamp, now);
      const auto& keyframes = driver_.node().agent().keyframes();
      if (!keyframes.empty() && keyframes.back().stamp == stamp) sensor_keyframes_.push_back(stamp);
    }
    if (scan == stamp) ++next_scan_;
    if (images == stamp) ++next_images_;
  }
}

/// One that is not wanted is not read.
void Replay::feed_scan(Timestamp stamp, Timestamp now) {
  if (!driver_.node().wants_scan(stamp)) return;
  const auto scan = recording_.scans->scan(next_scan_);
  if (!scan) return driver_.refuse_scan(scan.error().message, now);
  if (*scan) driver_.add(**scan, now);
}

void Replay::feed_images(Timestamp stamp, Timestamp now) {
  const auto track = [&](bool keyframe) {
    Driver::Seen seen{recording_.visual->images(next_images_, keyframe), {}};
    seen.images.imu_noise = recording_.imu_noise;
    seen.errors = recording_.visual->take_errors();
    return seen;
  };
  driver_.see(
      stamp, track, [&](Timestamp keyframe) { return imu_over(recording_.imu, keyframe, stamp); }, now);
}

}  // namespace tutti::drive
