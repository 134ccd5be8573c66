// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_clock.hpp"

#include <cmath>

namespace tutti::program {
namespace {

std::optional<std::int64_t> difference(std::int64_t a, std::int64_t b) {
  std::int64_t out = 0;
  if (__builtin_sub_overflow(a, b, &out)) return std::nullopt;
  return out;
}

}  // namespace

bool FeedClock::begin(std::optional<std::int64_t> offset_ns, std::optional<std::int64_t> client_now_ns,
                      Timestamp robot_now) {
  const auto measured = client_now_ns ? difference(robot_now.ns, *client_now_ns) : std::nullopt;
  if (client_now_ns && !measured) return false;
  const FeedClock before = *this;
  *this = {};
  if (offset_ns) {
    how_ = How::declared;
    offset_ns_ = *offset_ns;
  } else if (measured) {
    how_ = How::measured;
    offset_ns_ = *measured;
    first_ns_ = measured_ns_ = measured;
    first_at_ = measured_at_ = robot_now;
    const auto moved_ns = difference(*measured, before.offset_ns_);
    if (before.how_ == How::measured && moved_ns && std::abs(static_cast<double>(*moved_ns)) < kSame_s * 1e9)
      offset_ns_ = before.offset_ns_;
  }
  return true;
}

std::optional<std::int64_t> FeedClock::check(std::int64_t client_now_ns, Timestamp robot_now) {
  const auto measured = difference(robot_now.ns, client_now_ns);
  if (!measured) return std::nullopt;
  if (!first_ns_) {
    first_ns_ = measured;
    first_at_ = robot_now;
  }
  measured_ns_ = measured;
  measured_at_ = robot_now;
  return measured;
}

std::optional<double> FeedClock::drift_ppm() const {
  if (!first_ns_ || measured_at_ - first_at_ < kLeast_s) return std::nullopt;
  const auto moved_ns = difference(*first_ns_, *measured_ns_);  // a fast clock's offset falls
  if (!moved_ns) return std::nullopt;
  return 1e-3 * static_cast<double>(*moved_ns) / (measured_at_ - first_at_);
}

std::optional<Timestamp> FeedClock::to_robot(Timestamp stamp) const {
  Timestamp out;
  if (__builtin_add_overflow(stamp.ns, offset_ns_, &out.ns)) return std::nullopt;
  return out;
}

}  // namespace tutti::program
