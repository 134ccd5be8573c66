// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/answered_pairs.hpp"

#include <algorithm>
#include <utility>

#include "tutti/base/check.hpp"

namespace tutti::server {

void AnsweredPairs::add_submap(SubmapId id) {
  if (number_.try_emplace(id, static_cast<std::uint32_t>(answered_.size())).second) answered_.emplace_back();
}

AnsweredPairs::Place AnsweredPairs::place_of(const SubmapPair& pair) const {
  const auto [earlier, later] = std::minmax({number_.at(pair.first), number_.at(pair.second)});
  TUTTI_CHECK(earlier < later, "a submap with itself");
  return {later, earlier};
}

void AnsweredPairs::insert(const SubmapPair& pair) {
  const auto [later, earlier] = place_of(pair);
  auto& stretches = answered_[later];
  // The first that ends at this number or after it.
  auto next = std::ranges::lower_bound(stretches, earlier, {}, &Stretch::end);
  if (next == stretches.end() || earlier + 1 < next->begin) {
    stretches.insert(next, {earlier, earlier + 1});
    return;
  }
  next->begin = std::min(next->begin, earlier);
  if (earlier < next->end) return;
  ++next->end;
  const auto after = std::next(next);
  if (after == stretches.end() || next->end < after->begin) return;
  next->end = after->end;
  stretches.erase(after);
}

bool AnsweredPairs::contains(const SubmapPair& pair) const {
  if (!number_.contains(pair.first) || !number_.contains(pair.second)) return false;
  const auto [later, earlier] = place_of(pair);
  const auto& stretches = answered_[later];
  const auto next = std::ranges::upper_bound(stretches, earlier, {}, &Stretch::end);
  return next != stretches.end() && next->begin <= earlier;
}

void AnsweredPairs::forget_answers() {
  for (auto& stretches : answered_) stretches.clear();
}

std::size_t AnsweredPairs::watermark(SubmapId id) const {
  const auto& stretches = answered_[number_.at(id)];
  return stretches.empty() || stretches.front().begin > 0 ? 0 : stretches.front().end;
}

std::size_t AnsweredPairs::stretches_beyond() const {
  std::size_t count = 0;
  for (const auto& stretches : answered_)
    count += stretches.size() - (!stretches.empty() && stretches.front().begin == 0 ? 1 : 0);
  return count;
}

}  // namespace tutti::server
