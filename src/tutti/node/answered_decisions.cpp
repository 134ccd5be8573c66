// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/answered_decisions.hpp"

#include <algorithm>

#include "tutti/base/content_hash.hpp"
#include "tutti/base/plain_text.hpp"

namespace tutti::node {
namespace {

constexpr std::size_t kMostDecisions = 32;

}  // namespace

void AnsweredDecisions::note(const std::string& frame, const std::string& why) {
  const MissionStatus::Decision decision{content_hash(frame), plain_text(why)};
  std::erase_if(decisions_, [&](const MissionStatus::Decision& known) { return known.content == decision.content; });
  decisions_.push_back(decision);
  if (decisions_.size() > kMostDecisions) decisions_.erase(decisions_.begin());
}

bool AnsweredDecisions::is_stored(const std::string& frame) const {
  return std::ranges::count(decisions_, MissionStatus::Decision{content_hash(frame), {}}) > 0;
}

}  // namespace tutti::node
