// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/word_sender.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "tutti/base/content_hash.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {

WordSender::WordSender(bus::Endpoint self, const ClosureWord& word)
    : self_(self),
      id_(fmt::format("{}/{}/{}", to_string(word.wish), word.given_ns, self.number)),
      bytes_(std::make_shared<const std::string>(wire::encode(word))),
      content_(content_hash(*bytes_)) {}

std::optional<bus::Envelope> WordSender::due(double now_s) {
  if (sent_ > 0 && now_s < next_s_) return std::nullopt;
  next_s_ = now_s + kAgain_s;
  return bus::Envelope{self_, bus::Endpoint::server(), bus::MessageKind::word, fmt::format("{}/{}", id_, sent_++),
                       bytes_};
}

std::optional<std::string> WordSender::answer(const MissionStatus& status) const {
  const auto found = std::ranges::find(status.words, content_, &MissionStatus::Word::content);
  return found == status.words.end() ? std::nullopt : std::optional(found->why);
}

}  // namespace tutti::node
