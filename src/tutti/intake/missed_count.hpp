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
/// last 32 intervals, so that up to half of the messages may be missing. An interval above 1 s is a pause.
class MissedCount {
 public:
  static constexpr double kPause_s = 1.0;
  static constexpr std::size_t kIntervals = 32, kLeast = 8;  ///< There is a period from kLeast on.

  /// The next message, by its stamp.
  void note(Timestamp stamp);
  [[nodiscard]] std::uint64_t count() const { return count_; }

 private:
  std::optional<Timestamp> last_;
  std::deque<double> intervals_s_;
  std::uint64_t count_ = 0;
};

}  // namespace tutti::intake
