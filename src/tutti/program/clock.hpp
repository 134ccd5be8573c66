// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <functional>
#include <limits>
#include <utility>

#include "tutti/base/timestamp.hpp"

namespace tutti::program {

/// A program's mission time: wall seconds since the clock was made, times a rate, counted from `from_s`.
class Clock {
 public:
  /// Returns seconds that never go back.
  using Source = std::function<double()>;
  static double steady_s() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
  }

  explicit Clock(double rate = 1.0, double from_s = 0.0, Source source = steady_s)
      : source_(std::move(source)), rate_(rate), from_s_(from_s), start_s_(source_()) {}

  [[nodiscard]] double wall_s() const { return source_() - start_s_; }  ///< Since the clock was made.
  [[nodiscard]] double rate() const { return rate_; }                   ///< Mission seconds in a wall second.
  [[nodiscard]] double mission_s() const { return from_s_ + rate_ * wall_s(); }
  [[nodiscard]] Timestamp now() const { return Timestamp{} + mission_s(); }
  /// Wall seconds until `time`; 0 when that is past.
  [[nodiscard]] double wall_s_until(Timestamp time) const {
    return std::max(0.0, (static_cast<double>(time.ns) * 1e-9 - mission_s()) / rate_);
  }

 private:
  Source source_;
  double rate_;
  double from_s_;
  double start_s_;
};

/// Nanoseconds since the Unix epoch, by this machine's clock.
std::uint64_t wall_clock_ns();

}  // namespace tutti::program
