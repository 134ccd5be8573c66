// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <utility>

#include "tutti/base/timestamp.hpp"

namespace tutti::ros {

/// What a robot was fed and has not stored yet.
class Unstored {
 public:
  void add(Timestamp stamp, std::size_t bytes) {
    constexpr double kAnotherClock_s = 10.0;  // scans and images come that late at most
    if (!inputs_.empty() && inputs_.back().first - stamp > kAnotherClock_s) *this = {};  // the clock began anew
    inputs_.emplace_back(stamp, bytes);
    bytes_ += bytes;
  }
  /// The robot has everything up to `stamp`.
  void drop(const std::optional<Timestamp>& stamp) {
    for (; stamp && !inputs_.empty() && inputs_.front().first <= *stamp; inputs_.pop_front())
      bytes_ -= inputs_.front().second;
  }
  /// More than a robot should be fed at once: less than half of FeedFront::Limits.
  [[nodiscard]] bool is_much() const { return inputs_.size() > 2'000 || bytes_ > std::size_t{24} << 20U; }

 private:
  std::deque<std::pair<Timestamp, std::size_t>> inputs_;
  std::size_t bytes_ = 0;
};

}  // namespace tutti::ros
