// SPDX-License-Identifier: BSD-3-Clause
// The part of FeedFront for inputs other than odometry and scans: images, IMU samples, position fixes and ranges.
#include <fmt/format.h>

#include <utility>

#include "tutti/base/field_text.hpp"
#include "tutti/program/feed/agv_position.hpp"
#include "tutti/program/feed/feed_front.hpp"

namespace tutti::program {

void FeedFront::set_sensors(const Sensors& sensors) {
  const std::scoped_lock lock(mutex_);
  if (sensors == *sensors_) return;
  release(true);
  sensors_ = std::make_shared<const Sensors>(sensors);
  push(sensors_);
  fed_.notify_one();
}

bool FeedFront::is_ahead(Timestamp stamp, const InputKind& kind) const {
  return !carried_.newest() || stamp - carried_.newest()->stamp > kind.ahead_s;
}

std::size_t FeedFront::most_bytes(const Input& input) const {
  return std::holds_alternative<Scan>(input) ? limits_.scan_bytes : limits_.image_bytes;
}

/// Which scans and fixes are used, the robot decides (SubmapBuilder::add()), as of a recording.
Status FeedFront::may_wait(const Input& input) const {
  const InputKind& kind = kind_of(input);
  const Timestamp stamp = stamp_of(input);
  const auto where = [&] { return fmt::format("{} at {} ns", kind.name, stamp.ns); };
  const auto* scan = std::get_if<Scan>(&input);
  if (scan != nullptr && !scan->cloud) return fail(ErrorCode::invalid, "{} has no cloud", where());
  if (const auto* images = std::get_if<EncodedImages>(&input))
    if (auto ok = check_images(*images, *sensors_); !ok) return ok;
  if (const auto* fix = std::get_if<PositionFix>(&input))
    if (auto ok = check_fix(fix->antenna, fix->covariance, fix->p_body_antenna); !ok)
      return in_context(where(), ok.error());
  const auto* range = std::get_if<RobotRange>(&input);
  if (range != nullptr)
    if (auto ok = check_range(*range); !ok) return in_context(where(), ok.error());
  const std::optional<Timestamp>& newest = newest_[input.index()];
  const bool may_share = range != nullptr && newest && stamp == *newest;  // ranges to several robots at once
  if (scan == nullptr && newest && stamp <= *newest && !may_share)
    return fail(ErrorCode::invalid, "{}: there was one at {} ns, stamps must increase", where(), newest->ns);
  if (scan == nullptr && is_ahead(stamp, kind))
    return fail(ErrorCode::invalid, "{}: no odometry within {} s before", where(), kind.ahead_s);
  if (kind.needs == Needs::odometry_and_imu && carried_.newest()->stamp - stamp > waiting::kLate_s)
    return fail(ErrorCode::invalid, "{}: {:.1f} s after odometry of their time, expected at most {} s", where(),
                carried_.newest()->stamp - stamp, waiting::kLate_s);
  const std::size_t inputs = waiting(), bytes = bytes_[input.index()];
  if (bytes + bytes_of(input) <= most_bytes(input) && inputs < limits_.inputs / 2) return {};
  return fail(ErrorCode::io,
              "the map is behind: {} inputs and {} bytes of this kind wait, at most {} with {}; left out: {}", inputs,
              bytes, limits_.inputs / 2, most_bytes(input), where());
}

Status FeedFront::hear_sensor(Input input) {
  const std::size_t kind = input.index();
  const Timestamp stamp = stamp_of(input);
  if (Status ok = may_wait(input); !ok) {
    ++refused_[kind];
    if (ok.error().code != ErrorCode::io) return ok;
    note_behind(stamp);
    ++left_out_[kind];
    return ok;
  }
  ++heard_[kind];
  newest_[kind] = stamp;
  bytes_[kind] += bytes_of(input);
  if (kInputKinds[kind].needs != Needs::odometry_and_imu) {
    push(std::move(input));
    return {};
  }
  inputs_.push_back(std::make_shared<const FeedInput>(std::move(input)));
  ++held_;
  release();
  return {};
}

Status FeedFront::hear(EncodedImages& images) {
  images.sensors = sensors_;
  return hear_sensor(std::move(images));
}

Status FeedFront::hear(TrackedImages& images) {
  return fail(ErrorCode::unsupported, "tracked images at {} ns, expected the images", images.stamp.ns);
}

bool FeedFront::is_due(Timestamp images) const {
  const Timestamp newest = carried_.newest()->stamp;
  if (newest < images) return false;
  return !sensors_->imu || (!imu_.empty() && imu_.back().stamp >= images) || newest - images >= waiting::kImu_s;
}

/// Held images whose odometry and IMU have come are due, or all: what has not come yet will not help them any more.
void FeedFront::release(bool all) {
  while (held_ > 0 && (all || is_due(stamp_of(*inputs_[inputs_.size() - held_])))) --held_;
}

Status FeedFront::hear(ImuSamples& samples) {
  constexpr std::size_t kImu = index_of<ImuSamples>();
  if (!sensors_->imu)
    return fail(ErrorCode::unsupported, "{} IMU samples: Hello announces no IMU (Sensors.imu)", samples.size());
  std::size_t backwards = 0, ahead = 0;
  for (const ImuSample& sample : samples) {
    const bool is_backwards = !imu_.empty() && sample.stamp <= imu_.back().stamp;
    if (is_backwards)
      ++backwards;
    else if (is_ahead(sample.stamp, kInputKinds[kImu]))
      ++ahead;
    else
      imu_.push_back(sample);
  }
  heard_[kImu] += samples.size() - backwards - ahead;
  refused_[kImu] += backwards + ahead;
  while (imu_.size() > limits_.imu) imu_.pop_front();
  release();
  if (backwards + ahead == 0) return {};
  return fail(
      ErrorCode::invalid,
      "of {} IMU samples from {} ns on {} are not after the one before, and of {} there is no odometry within {} s "
      "before",
      samples.size(), samples.front().stamp.ns, backwards, ahead, kInputKinds[kImu].ahead_s);
}

Status FeedFront::hear(Health& health) {
  health_ = health;
  health_came_ = std::chrono::steady_clock::now();
  return {};
}

Status FeedFront::hear(StartPose& start) {
  if (waiting() >= limits_.inputs / 2)
    return fail(ErrorCode::io, "the map is behind: {} inputs wait, at most {} with a start pose", waiting(),
                limits_.inputs / 2);
  push(start);
  return {};
}

Health FeedFront::health() const {
  const std::scoped_lock lock(mutex_);
  return std::chrono::steady_clock::now() - health_came_ < kHealthLasts ? health_ : Health{};
}

void FeedFront::say_status(const NodeStatus& status) {
  auto texts = field_texts(status);
  if (!status.in_map.map.empty()) texts.emplace_back("agv_position", agv_position(status.in_map));
  const std::scoped_lock lock(mutex_);
  if (!status_ || *status_ != texts) status_ = std::make_shared<const decltype(texts)>(std::move(texts));
}

}  // namespace tutti::program
