// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <optional>
#include <thread>

namespace tutti::mission {

/// Keeps virtual time in step with the wall clock, when asked to.
class Pace {
 public:
  explicit Pace(std::optional<double> rate) : rate_(rate) {}
  void wait_until(double time_s) const {
    if (rate_) std::this_thread::sleep_until(start_ + std::chrono::duration<double>(time_s / *rate_));
  }
  /// Wall milliseconds since the instant that `time_s` stood for.
  [[nodiscard]] double late_ms(double time_s) const {
    if (!rate_) return 0.0;
    return std::chrono::duration<double, std::milli>(Clock::now() - start_).count() - 1e3 * time_s / *rate_;
  }
  [[nodiscard]] double wall_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  std::optional<double> rate_;
  std::chrono::time_point<Clock, std::chrono::duration<double>> start_ = Clock::now();
};

}  // namespace tutti::mission
