// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/sensor_clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace tutti::bags {
namespace {

constexpr std::size_t kLeast = 10, kMost = 100;  // messages that are compared

/// Clocks mostly differ by whole seconds (TAI, GPS, UTC, time zones), and messages arrive a little late.
std::string aligned_by(double ahead_s, const std::string& setting) {
  constexpr double kArrival_s = 0.3;
  if (setting.empty()) return {};
  const double whole_s = std::round(ahead_s);
  const std::string value =
      std::abs(ahead_s - whole_s) < kArrival_s ? fmt::format("{:.0f}", -whole_s) : fmt::format("{:.1f}", -ahead_s);
  constexpr double kTaiUtc_s = 37.0, kGpsUtc_s = 18.0;
  const std::string why = std::abs(whole_s) == kTaiUtc_s   ? "as TAI is from UTC; "
                          : std::abs(whole_s) == kGpsUtc_s ? "as GPS time is from UTC; "
                                                           : "";
  return fmt::format(" ({}to align them: {}={})", why, setting, value);
}

}  // namespace

Status check_clock(Timestamp stamp, const std::optional<Timestamp>& newest_odometry, const std::string& setting) {
  if (!newest_odometry) return {};
  const double ahead_s = stamp - *newest_odometry;
  if (std::abs(ahead_s) <= kAnotherClock_s) return {};
  if (stamp.ns == 0)
    return fail(ErrorCode::invalid,
                "stamp 0 ns, expected one near odometry's newest, {} ns: its publisher does not fill "
                "header.stamp",
                newest_odometry->ns);
  return fail(ErrorCode::invalid, "stamp {} ns is {:.1f} s from odometry's newest, {} ns: are they by another clock?{}",
              stamp.ns, ahead_s, newest_odometry->ns, aligned_by(ahead_s, setting));
}

OdometryArrivals::OdometryArrivals(std::span<const Arrival> odometry) : arrivals_(odometry.begin(), odometry.end()) {
  if (arrivals_.empty()) return;
  std::ranges::sort(arrivals_, {}, &Arrival::logged);
  const auto [oldest, newest] = std::ranges::minmax(arrivals_, {}, &Arrival::stamp);
  const bool go_on = 2.0 * (arrivals_.back().logged - arrivals_.front().logged) >= newest.stamp - oldest.stamp;
  if (!go_on) arrivals_.clear();
  for (std::size_t i = 1; i < arrivals_.size(); ++i)
    arrivals_[i].stamp = std::max(arrivals_[i].stamp, arrivals_[i - 1].stamp);
}

std::optional<Timestamp> OdometryArrivals::newest_at(Timestamp logged) const {
  const auto behind = std::ranges::upper_bound(arrivals_, logged, {}, &Arrival::logged);
  return behind == arrivals_.begin() ? std::nullopt : std::optional(std::prev(behind)->stamp);
}

Status SensorClock::check(Timestamp stamp, const std::optional<Timestamp>& newest_odometry) {
  if (newest_odometry) ahead_s_.push_back(stamp - *newest_odometry);
  if (ahead_s_.size() > kMost) ahead_s_.pop_front();
  return check_clock(stamp, newest_odometry, setting_);
}

std::string SensorClock::take_doubt() {
  if (is_said_ || ahead_s_.size() < kLeast) return {};
  std::vector<double> sorted(ahead_s_.begin(), ahead_s_.end());
  std::ranges::sort(sorted);
  const double median_s = sorted[sorted.size() / 2];
  if (std::abs(median_s) < kDoubtedClock_s) return {};
  is_said_ = true;
  return fmt::format(
      "when they arrive, stamps are {:.1f} s {} odometry's newest (median of {}, {:.1f} to {:.1f} s): another clock, "
      "or "
      "odometry that comes late{}",
      std::abs(median_s), median_s > 0.0 ? "ahead of" : "behind", sorted.size(), sorted.front(), sorted.back(),
      aligned_by(median_s, setting_));
}

}  // namespace tutti::bags
