// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <string>

#include "tutti/program/clock.hpp"

namespace tutti::mission {

/// Processor and number of threads in words, as far as the system reports them.
std::string machine_description();

/// Largest resident memory of this process so far, in 10^6 bytes; 0 where the system does not report it.
double peak_memory_mb();

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

/// Adds the CPU time of a scope to a total.
class CpuScope {
 public:
  explicit CpuScope(double& total_s) : total_s_(total_s), begin_s_(program::thread_cpu_s()) {}
  ~CpuScope() { total_s_ += program::thread_cpu_s() - begin_s_; }
  CpuScope(const CpuScope&) = delete;
  CpuScope& operator=(const CpuScope&) = delete;

 private:
  double& total_s_;
  double begin_s_;
};

}  // namespace tutti::mission
