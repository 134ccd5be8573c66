// SPDX-License-Identifier: BSD-3-Clause
// What is fed beside odometry and scans: images, IMU samples and position fixes.
#include <fmt/format.h>

#include <utility>

#include "tutti/base/field_text.hpp"
#include "tutti/program/feed/feed_front.hpp"

namespace tutti::program {

void FeedFront::set_sensors(const intake::FeedSensors& sensors) {
  const std::scoped_lock lock(mutex_);
  if (sensors == *sensors_) return;
  release_images(true);
  sensors_ = std::make_shared<const intake::FeedSensors>(sensors);
  push(sensors_);
  fed_.notify_one();
}

bool FeedFront::is_ahead(Timestamp stamp) const {
  return !localiser_.newest() || stamp - localiser_.newest()->stamp > kAhead_s;
}

Status FeedFront::may_wait(const intake::FedImages& images) const {
  if (auto ok = intake::check_images(images, *sensors_); !ok) return ok;
  if (newest_images_ && images.stamp <= *newest_images_)
    return fail(ErrorCode::invalid, "images at {} ns: there were some at {} ns, stamps must increase", images.stamp.ns,
                newest_images_->ns);
  if (is_ahead(images.stamp))
    return fail(ErrorCode::invalid, "images at {} ns: no odometry within {} s before", images.stamp.ns, kAhead_s);
  if (image_bytes_ + intake::bytes_of(images) > limits_.image_bytes || waiting() + images_.size() >= limits_.inputs / 2)
    return fail(ErrorCode::io,
                "the map is behind: {} inputs and {} bytes of images wait, at most {} with {}; the images at {} ns are "
                "left out",
                waiting() + images_.size(), image_bytes_, limits_.inputs / 2, limits_.image_bytes, images.stamp.ns);
  return {};
}

Status FeedFront::add_images(intake::FedImages fed) {
  const auto images = std::make_shared<intake::FedImages>(std::move(fed));
  const std::scoped_lock lock(mutex_);
  if (closed_) return fail(ErrorCode::io, "the robot's program ends");
  if (Status ok = may_wait(*images); !ok) {
    ++images_refused_;
    if (ok.error().code == ErrorCode::io) {
      note_behind(images->stamp);
      ++images_left_out_;
    }
    return ok;
  }
  ++images_taken_;
  newest_images_ = images->stamp;
  image_bytes_ += intake::bytes_of(*images);
  images->sensors = sensors_;
  images_.push_back(images);
  release_images();
  fed_.notify_one();
  return {};
}

/// Those whose odometry and IMU have come, or all: what has not come yet will not help them any more.
void FeedFront::release_images(bool all) {
  const auto is_due = [&](Timestamp stamp) {
    if (all) return true;
    if (localiser_.newest()->stamp < stamp) return false;
    return !sensors_->imu || (!imu_.empty() && imu_.back().stamp >= stamp) ||
           localiser_.newest()->stamp - stamp >= kImuPatience_s;
  };
  for (; !images_.empty() && is_due(images_.front()->stamp); images_.pop_front()) push(std::move(images_.front()));
}

Status FeedFront::add_imu(const std::vector<ImuSample>& samples) {
  const std::scoped_lock lock(mutex_);
  if (closed_) return fail(ErrorCode::io, "the robot's program ends");
  if (!sensors_->imu)
    return fail(ErrorCode::unsupported, "{} IMU samples: Hello said of no IMU (Sensors.imu)", samples.size());
  std::size_t backwards = 0, ahead = 0;
  for (const ImuSample& sample : samples) {
    const bool is_backwards = !imu_.empty() && sample.stamp <= imu_.back().stamp;
    if (is_backwards)
      ++backwards;
    else if (is_ahead(sample.stamp))
      ++ahead;
    else
      imu_.push_back(sample);
  }
  imu_taken_ += samples.size() - backwards - ahead;
  imu_refused_ += backwards + ahead;
  while (imu_.size() > limits_.imu) imu_.pop_front();
  release_images();
  fed_.notify_one();
  if (backwards + ahead == 0) return {};
  return fail(
      ErrorCode::invalid,
      "of {} IMU samples from {} ns on {} are not after the one before, and of {} there is no odometry within {} s "
      "before",
      samples.size(), samples.front().stamp.ns, backwards, ahead, kAhead_s);
}

Status FeedFront::may_wait(const PositionFix& fix) const {
  const auto where = [&] { return fmt::format("fix at {} ns", fix.stamp.ns); };
  if (auto ok = check_fix(fix.antenna, fix.covariance, fix.p_body_antenna); !ok) return in_context(where(), ok.error());
  if (newest_fix_ && fix.stamp <= *newest_fix_)
    return fail(ErrorCode::invalid, "{}: there was one at {} ns, stamps must increase", where(), newest_fix_->ns);
  if (is_ahead(fix.stamp)) return fail(ErrorCode::invalid, "{}: no odometry within {} s before", where(), kAhead_s);
  if (waiting() < limits_.inputs / 2) return {};
  return fail(ErrorCode::io, "the map is behind: {} inputs wait, at most {}; the {} is left out", waiting(),
              limits_.inputs / 2, where());
}

void FeedFront::set_health(const Health& health) {
  const std::scoped_lock lock(mutex_);
  health_ = health;
  health_came_ = std::chrono::steady_clock::now();
}

Health FeedFront::health() const {
  const std::scoped_lock lock(mutex_);
  return std::chrono::steady_clock::now() - health_came_ < kHealthLasts ? health_ : Health{};
}

void FeedFront::say_status(const NodeStatus& status) {
  auto texts = field_texts(status);
  const std::scoped_lock lock(mutex_);
  if (!status_ || *status_ != texts) status_ = std::make_shared<const decltype(texts)>(std::move(texts));
}

/// Which of them are used, the robot decides (SubmapBuilder::add_fix()), as of a recording.
Status FeedFront::add_fix(const PositionFix& fix) {
  const std::scoped_lock lock(mutex_);
  if (closed_) return fail(ErrorCode::io, "the robot's program ends");
  if (Status ok = may_wait(fix); !ok) {
    ++fixes_refused_;
    return ok;
  }
  ++fixes_taken_;
  newest_fix_ = fix.stamp;
  push(fix);
  fed_.notify_one();
  return {};
}

}  // namespace tutti::program
