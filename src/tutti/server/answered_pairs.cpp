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
  answered_[later].insert(earlier);
}

bool AnsweredPairs::contains(const SubmapPair& pair) const {
  if (!number_.contains(pair.first) || !number_.contains(pair.second)) return false;
  const auto [later, earlier] = place_of(pair);
  return answered_[later].contains(earlier);
}

void AnsweredPairs::forget_answers() {
  for (NumberSet& answered : answered_) answered.clear();
}

std::size_t AnsweredPairs::watermark(SubmapId id) const { return answered_[number_.at(id)].watermark(); }

std::size_t AnsweredPairs::stretches_beyond() const {
  std::size_t count = 0;
  for (const NumberSet& answered : answered_) count += answered.stretches().size() - (answered.watermark() > 0 ? 1 : 0);
  return count;
}

}  // namespace tutti::server
