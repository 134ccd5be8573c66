// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <ctime>
#include <optional>

#include "tutti/robot/agent.hpp"

/// How long things take. Nothing but reports depends on it.
namespace tutti::drive {

/// Measures wall time in milliseconds, since it was made or last asked.
class Stopwatch {
 public:
  double lap_ms() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// CPU time of the calling thread so far, in seconds.
inline double thread_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Adds the CPU time of a scope to a total.
class CpuScope {
 public:
  explicit CpuScope(double& total_s) : total_s_(total_s), begin_s_(thread_cpu_s()) {}
  ~CpuScope() { total_s_ += thread_cpu_s() - begin_s_; }
  CpuScope(const CpuScope&) = delete;
  CpuScope& operator=(const CpuScope&) = delete;

 private:
  double& total_s_;
  double begin_s_;
};

/// How long an agent took for an update of the map, from the broadcast to the corrected trajectory.
struct UpdateTime {
  double update_ms = 0.0;
  double comparison_ms = 0.0, optimisation_ms = 0.0;  ///< Its stages.
  template <class V>
  void describe(V& v) {
    v.field(1, "update_ms", update_ms);
    v.field(2, "comparison_ms", comparison_ms);
    v.field(3, "optimisation_ms", optimisation_ms);
  }
};

/// Measures an update; to be made when it begins.
class UpdateStopwatch {
 public:
  void stage_ended(robot::UpdateStage stage) {
    const double ms = stage_.lap_ms();
    if (!time_) time_.emplace();
    (stage == robot::UpdateStage::choose ? time_->comparison_ms : time_->optimisation_ms) = ms;
  }
  /// To be called when the update has ended; nothing when it had no stages, because the broadcast was no news.
  std::optional<UpdateTime> ended() {
    if (time_) time_->update_ms = whole_.lap_ms();
    return time_;
  }

 private:
  Stopwatch whole_, stage_;
  std::optional<UpdateTime> time_;
};

}  // namespace tutti::drive
