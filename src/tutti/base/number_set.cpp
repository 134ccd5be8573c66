// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/number_set.hpp"

#include <algorithm>
#include <iterator>

namespace tutti {

void NumberSet::insert(std::uint64_t number) {
  // The first that ends at this number or after it.
  const auto next = std::ranges::lower_bound(intervals_, number, {}, &Interval::end);
  if (next == intervals_.end() || number + 1 < next->begin) {
    intervals_.insert(next, {number, number + 1});
    return;
  }
  next->begin = std::min(next->begin, number);
  if (number < next->end) return;
  ++next->end;
  const auto after = std::next(next);
  if (after == intervals_.end() || next->end < after->begin) return;
  next->end = after->end;
  intervals_.erase(after);
}

void NumberSet::erase(std::uint64_t number) {
  const auto found = std::ranges::upper_bound(intervals_, number, {}, &Interval::end);
  if (found == intervals_.end() || number < found->begin) return;
  const Interval before{found->begin, number}, after{number + 1, found->end};
  auto at = intervals_.erase(found);
  if (after.begin < after.end) at = intervals_.insert(at, after);
  if (before.begin < before.end) intervals_.insert(at, before);
}

bool NumberSet::contains(std::uint64_t number) const {
  const auto next = std::ranges::upper_bound(intervals_, number, {}, &Interval::end);
  return next != intervals_.end() && next->begin <= number;
}

std::uint64_t NumberSet::watermark() const {
  return intervals_.empty() || intervals_.front().begin > 0 ? 0 : intervals_.front().end;
}

bool NumberSet::append(Interval interval) {
  if (interval.begin >= interval.end || (!intervals_.empty() && interval.begin <= intervals_.back().end)) return false;
  intervals_.push_back(interval);
  return true;
}

}  // namespace tutti
