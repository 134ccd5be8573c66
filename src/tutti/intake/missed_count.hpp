// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "tutti/base/timestamp.hpp"

namespace tutti::intake {

/// Estimates how many messages of a sensor were never heard, from the stamps of those that were: DDS reports neither
/// what a full reader has dropped nor what a best-effort publisher has lost. The period is the lower quartile of the
/// last 32 intervals, so that up to half of the messages may be missing. An interval above 1 s is a pause. A sensor
/// that sends at no fixed rate (keyframes) misses nothing: its intervals are not whole numbers of a period.
class MissedCount {
 public:
  static constexpr double kPause_s = 1.0;
  static constexpr std::size_t kIntervals = 32, kLeast = 8;  ///< There is a period from kLeast on.
  /// Intervals of up to kShort periods say whether the rate is fixed: a share of kFixed is within kOff of one or two.
  /// Longer ones are left out, since the jitter of a period adds up over them.
  static constexpr double kShort = 2.5, kOff = 0.3, kFixed = 0.85;

  /// The next message, by its stamp.
  void note(Timestamp stamp);
  [[nodiscard]] std::uint64_t count() const { return count_; }

 private:
  std::optional<Timestamp> last_;
  std::deque<double> intervals_s_;
  std::uint64_t count_ = 0;
};

}  // namespace tutti::intake
