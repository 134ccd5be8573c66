// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/answered_words.hpp"

#include "tutti/base/content_hash.hpp"
#include "tutti/base/plain_text.hpp"

namespace tutti::node {
namespace {

constexpr std::size_t kMostWords = 32;

}  // namespace

void AnsweredWords::note(const std::string& frame, const std::string& why) {
  const MissionStatus::Word word{content_hash(frame), plain_text(why)};
  std::erase_if(words_, [&](const MissionStatus::Word& known) { return known.content == word.content; });
  words_.push_back(word);
  if (words_.size() > kMostWords) words_.erase(words_.begin());
}

}  // namespace tutti::node
