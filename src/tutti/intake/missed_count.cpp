// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/intake/missed_count.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

namespace tutti::intake {
namespace {

// The lower quartile, so that up to half of the messages may be missing; then the mean of what is near it, since a
// quartile of jitter lies below the period.
double period_of(const std::deque<double>& intervals_s) {
  std::vector<double> sorted(intervals_s.begin(), intervals_s.end());
  const auto quartile = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 4);
  std::ranges::nth_element(sorted, quartile);
  const auto end = std::partition(sorted.begin(), sorted.end(),
                                  [limit = 1.5 * *quartile](double interval_s) { return interval_s < limit; });
  return std::accumulate(sorted.begin(), end, 0.0) / static_cast<double>(end - sorted.begin());
}

// Whether intervals are whole numbers of the period, as far as the short ones tell.
bool is_fixed_rate(const std::deque<double>& intervals_s, double period_s) {
  std::size_t close = 0, all = 0;
  for (const double interval_s : intervals_s) {
    const double periods = interval_s / period_s;
    if (periods > MissedCount::kShort) continue;
    ++all;
    if (std::abs(periods - std::round(periods)) <= MissedCount::kOff) ++close;
  }
  return static_cast<double>(close) >= MissedCount::kFixed * static_cast<double>(all);
}

}  // namespace

void MissedCount::note(Timestamp stamp) {
  const auto before = std::exchange(last_, stamp);
  if (!before || stamp <= *before || stamp - *before > kPause_s) return;
  const double interval_s = stamp - *before;
  if (intervals_s_.size() >= kLeast) {
    const double period_s = period_of(intervals_s_);
    if (is_fixed_rate(intervals_s_, period_s))
      count_ += static_cast<std::uint64_t>(std::max(0L, std::lround(interval_s / period_s) - 1));
  }
  intervals_s_.push_back(interval_s);
  if (intervals_s_.size() > kIntervals) intervals_s_.pop_front();
}

}  // namespace tutti::intake
