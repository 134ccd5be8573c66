// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/base/timestamp.hpp"

namespace tutti::node {

/// The last update: what the next one waits for, also when the server starts again in between.
struct LastUpdate {
  Timestamp begun;
  double cost_s = 0.0;
};

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
  /// `last`: nothing when no update was made yet.
  UpdatePacer(const Limits& limits, const std::optional<LastUpdate>& last) : limits_(limits), last_(last) {}

  /// The earliest time for an update, `now` or later. If the clock has stepped back to before the last update began,
  /// that counts as begun now, so that a wrong clock holds up one update at most, and for no longer than any other.
  [[nodiscard]] Timestamp earliest(Timestamp now, bool operator_decided = false);
  /// An update that was begun has ended.
  void end(const LastUpdate& last) { last_ = last; }

 private:
  Limits limits_;
  std::optional<LastUpdate> last_;
};

}  // namespace tutti::node
