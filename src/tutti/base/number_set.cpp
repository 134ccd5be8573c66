// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/number_set.hpp"

#include <algorithm>
#include <iterator>

namespace tutti {

void NumberSet::insert(std::uint64_t number) {
  // The first that ends at this number or after it.
  const auto next = std::ranges::lower_bound(stretches_, number, {}, &Stretch::end);
  if (next == stretches_.end() || number + 1 < next->begin) {
    stretches_.insert(next, {number, number + 1});
    return;
  }
  next->begin = std::min(next->begin, number);
  if (number < next->end) return;
  ++next->end;
  const auto after = std::next(next);
  if (after == stretches_.end() || next->end < after->begin) return;
  next->end = after->end;
  stretches_.erase(after);
}

void NumberSet::erase(std::uint64_t number) {
  const auto found = std::ranges::upper_bound(stretches_, number, {}, &Stretch::end);
  if (found == stretches_.end() || number < found->begin) return;
  const Stretch before{found->begin, number}, after{number + 1, found->end};
  auto at = stretches_.erase(found);
  if (after.begin < after.end) at = stretches_.insert(at, after);
  if (before.begin < before.end) stretches_.insert(at, before);
}

bool NumberSet::contains(std::uint64_t number) const {
  const auto next = std::ranges::upper_bound(stretches_, number, {}, &Stretch::end);
  return next != stretches_.end() && next->begin <= number;
}

std::uint64_t NumberSet::watermark() const {
  return stretches_.empty() || stretches_.front().begin > 0 ? 0 : stretches_.front().end;
}

bool NumberSet::append(Stretch stretch) {
  if (stretch.begin >= stretch.end || (!stretches_.empty() && stretch.begin <= stretches_.back().end)) return false;
  stretches_.push_back(stretch);
  return true;
}

}  // namespace tutti
