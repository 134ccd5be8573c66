// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace tutti::program {

/// Limits log lines that strangers can cause at will: per kind, kBurst lines may come at once, then one every
/// kPeriod_s, which states how many were left out.
class Throttle {
 public:
  static constexpr double kBurst = 20.0;
  static constexpr double kPeriod_s = 10.0;

  struct Verdict {
    bool passes = false;
    std::uint64_t left_out = 0;  ///< Lines of this kind since the last one that passed.
  };
  /// Whether a line of this kind passes at `wall_s` (any clock).
  Verdict ask(const std::string& kind, double wall_s);

 private:
  struct Kind {
    double tokens = kBurst;
    double since_s = 0.0;
    std::uint64_t left_out = 0;
  };
  std::map<std::string, Kind> kinds_;  // as many as there are kinds of events and messages
};

}  // namespace tutti::program
