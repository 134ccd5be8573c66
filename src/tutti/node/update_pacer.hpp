// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/base/timestamp.hpp"

namespace tutti::node {

/// When a server may begin its next update: at once when something new has come, but no sooner than `least_s` after the
/// last one began, and such that updates take no more than `share` of a core over any time. An update that has cost c
/// seconds of CPU therefore keeps the next one back until c / share after it began. All times are of the mission's
/// clock, and so is the cost. An operator who has decided something waits for `least_s` alone.
class UpdatePacer {
 public:
  struct Limits {
    double least_s = 0.5;
    double share = 0.25;
  };
  explicit UpdatePacer(const Limits& limits) : limits_(limits) {}

  /// The earliest time for an update, `now` or later. If the clock has stepped back to before the last update began,
  /// that counts as begun now, so that a wrong clock holds up one update at most, and for no longer than any other.
  [[nodiscard]] Timestamp earliest(Timestamp now, bool operator_decided = false);
  void begin(Timestamp now) { begun_ = now; }
  /// The update that was begun has ended.
  void end(double cost_s) { cost_s_ = cost_s; }

 private:
  Limits limits_;
  std::optional<Timestamp> begun_;  // nothing: no update since the start
  double cost_s_ = 0.0;             // of the last update
};

}  // namespace tutti::node
