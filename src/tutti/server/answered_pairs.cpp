// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/answered_pairs.hpp"

#include <algorithm>
#include <utility>

#include "tutti/base/check.hpp"

namespace tutti::server {

void AnsweredPairs::add_submap(SubmapId id) {
  if (!number_.try_emplace(id, static_cast<std::uint32_t>(ids_.size())).second) return;
  ids_.push_back(id);
  answered_.emplace_back();
}

AnsweredPairs::Place AnsweredPairs::place_of(const SubmapPair& pair) const {
  const auto [earlier, later] = std::minmax({number_.at(pair.first), number_.at(pair.second)});
  TUTTI_CHECK(earlier < later, "a submap with itself");
  return {later, earlier};
}

bool AnsweredPairs::has_both(const SubmapPair& pair) const {
  return number_.contains(pair.first) && number_.contains(pair.second);
}

bool AnsweredPairs::insert(const SubmapPair& pair) {
  const auto [later, earlier] = place_of(pair);
  if (answered_[later].contains(earlier)) return false;
  answered_[later].insert(earlier);
  return true;
}

void AnsweredPairs::insert_all_but(SubmapId id, std::span<const SubmapId> open) {
  const std::uint32_t later = number_.at(id);
  std::vector<std::uint64_t> left;
  for (const SubmapId& other : open)
    if (const std::uint32_t number = number_.at(other); number < later && !answered_[later].contains(number))
      left.push_back(number);
  std::ranges::sort(left);
  left.erase(std::ranges::unique(left).begin(), left.end());
  left.push_back(later);
  NumberSet all;
  std::uint64_t begin = 0;
  for (const std::uint64_t end : left) {
    all.append({begin, end});
    begin = end + 1;
  }
  answered_[later] = std::move(all);
}

bool AnsweredPairs::contains(const SubmapPair& pair) const {
  if (!has_both(pair)) return false;
  const auto [later, earlier] = place_of(pair);
  return answered_[later].contains(earlier);
}

std::vector<SubmapPair> AnsweredPairs::open(SubmapId id) const {
  const std::uint32_t later = number_.at(id);
  std::vector<SubmapPair> open;
  std::uint64_t next = 0;
  const auto take_until = [&](std::uint64_t end) {
    for (; next < end; ++next) {
      const auto [first, second] = std::minmax(ids_[next], id);
      open.push_back({first, second});
    }
  };
  for (const auto& [begin, end] : answered_[later].intervals()) {
    take_until(begin);
    next = end;
  }
  take_until(later);
  return open;
}

void AnsweredPairs::forget_answers() {
  for (NumberSet& answered : answered_) answered.clear();
}

std::size_t AnsweredPairs::watermark(SubmapId id) const { return answered_[number_.at(id)].watermark(); }

std::size_t AnsweredPairs::intervals_beyond() const {
  std::size_t count = 0;
  for (const NumberSet& answered : answered_) count += answered.intervals().size() - (answered.watermark() > 0 ? 1 : 0);
  return count;
}

}  // namespace tutti::server
