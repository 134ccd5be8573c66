// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>

#include "tutti/base/timestamp.hpp"

namespace tutti {

/// The iterator to the element whose stamp is nearest to `stamp`, of two that are as near to the later one; the end of
/// the range if none is within `max_difference_s`. The range is sorted by increasing stamps, which `stamp_of` projects.
template <class Range, class StampOf>
auto nearest_in_time(const Range& range, Timestamp stamp, double max_difference_s, StampOf stamp_of) {
  const auto away_s = [&](const auto& element) { return std::abs(std::invoke(stamp_of, element) - stamp); };
  const auto begin = std::ranges::begin(range), end = std::ranges::end(range);
  auto found = std::ranges::lower_bound(begin, end, stamp, {}, stamp_of);
  if (found != begin && (found == end || away_s(*std::prev(found)) < away_s(*found))) --found;
  return found != end && away_s(*found) <= max_difference_s ? found : end;
}

}  // namespace tutti
