// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tutti/bags/stamp_order.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"

namespace tutti::bags {

/// A sensor's message that is farther than this from the odometry that is newest when it arrives is by another clock.
inline constexpr double kAnotherClock_s = 10.0;
/// A sensor whose messages are this far from it, most of them, is doubted.
inline constexpr double kDoubtedClock_s = 1.0;

/// Fails for a stamp that is farther than kAnotherClock_s from odometry's newest, if there is any. The error has the
/// difference, and where `setting` names one, the value of it that would align the two.
Status check_clock(Timestamp stamp, const std::optional<Timestamp>& newest_odometry, const std::string& setting = "");

/// Finds the odometry that was newest at a time of a bag's recorder.
class OdometryArrivals {
 public:
  /// Nothing is known if the log times of the bag do not advance as the stamps do: then they are no times of arrival.
  explicit OdometryArrivals(std::span<const Arrival> odometry);
  [[nodiscard]] std::optional<Timestamp> newest_at(Timestamp logged) const;

 private:
  std::vector<Arrival> arrivals_;  ///< By log time, each with the newest stamp until then.
};

/// Compares the stamps of one sensor's messages with odometry's, live and from a bag alike: each by what odometry was
/// newest when it arrived.
class SensorClock {
 public:
  explicit SensorClock(std::string setting) : setting_(std::move(setting)) {}
  /// check_clock(); also remembers the difference.
  Status check(Timestamp stamp, const std::optional<Timestamp>& newest_odometry);
  /// How far the stamps are from odometry's if that is doubtful, once; else empty: "stamps are 2.0 s behind ..".
  std::string take_doubt();

 private:
  std::string setting_;
  std::deque<double> ahead_s_;  ///< By the last messages.
  bool is_said_ = false;
};

}  // namespace tutti::bags
