// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/intake/missed_count.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace tutti::intake {

void MissedCount::note(Timestamp stamp) {
  const auto before = std::exchange(last_, stamp);
  if (!before || stamp <= *before || stamp - *before > kPause_s) return;
  const double interval_s = stamp - *before;
  if (intervals_s_.size() >= kLeast) {
    std::vector<double> sorted(intervals_s_.begin(), intervals_s_.end());
    const auto quartile = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 4);
    std::ranges::nth_element(sorted, quartile);
    count_ += static_cast<std::uint64_t>(std::max(0L, std::lround(interval_s / *quartile) - 1));
  }
  intervals_s_.push_back(interval_s);
  if (intervals_s_.size() > kIntervals) intervals_s_.pop_front();
}

}  // namespace tutti::intake
