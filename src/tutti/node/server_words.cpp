// SPDX-License-Identifier: BSD-3-Clause
// What operators say to the server of closures.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tutti/base/plain_text.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/words.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace {

constexpr std::size_t kLongestName = 64;  // of `tutti pki`

}  // namespace

/// An operator's word is not a robot's or a worker's to give.
void ServerNode::receive_word(const bus::Envelope& envelope, Timestamp now, Step& step) {
  if (envelope.from.role != bus::Endpoint::Role::viewer)
    return refuse(
        envelope,
        fmt::format("a decision on closures from a {}, which only operators may make", name(envelope.from.role)), now,
        step);
  auto word = wire::decode_word(*envelope.bytes);
  if (!word) return refuse(envelope, word.error().message, now, step);
  if (!envelope.user.empty()) word->by = plain_text(envelope.user, kLongestName);  // whatever it claims
  const auto is_late = take_word(envelope, *word, now, step);
  if (!is_late) refuse(envelope, is_late.error().message, now, step);
  note_word(*envelope.bytes, !is_late ? is_late.error().message : *is_late ? "a later decision on it holds" : "");
}

Result<bool> ServerNode::take_word(const bus::Envelope& envelope, const ClosureWord& word, Timestamp now, Step& step) {
  const auto pair = closure_names().find(word.closure);
  if (!pair) return tl::unexpected(pair.error());
  const WordSet& words = server_.state().words;
  const auto known = words.find(*pair);
  const auto before = known == words.end() ? std::nullopt : std::optional(known->second);
  if (auto taken = server_.receive(*pair, word); !taken) return tl::unexpected(taken.error());
  if (before == words.at(*pair)) return before != word;
  step.writes.push_back(
      {map_tables::kWords, key_of(*pair), envelope.user.empty() ? *envelope.bytes : wire::encode(word)});
  step.tell(now, WordTaken{*pair, word.wish});
  operator_spoke_ = true;
  send_jobs(std::nullopt, now, 0, config_.pairs_per_job, step);
  return false;
}

void ServerNode::note_word(const std::string& frame, const std::string& why) {
  words_.note(frame, why);
  ++changes_;
}

void ServerNode::recall_words() {
  std::vector<ClosureWord> given;
  for (const auto& [pair, word] : server_.state().words) given.push_back(word);
  std::ranges::sort(given, {}, &ClosureWord::given_ns);
  for (const ClosureWord& word : given) note_word(wire::encode(word), {});
}

std::map<RobotId, std::string> ServerNode::robot_names() const {
  std::map<RobotId, std::string> names;
  for (const auto& [robot, entry] : registry_.robots())
    if (entry.is_claimed) names[robot] = entry.status.name;
  return names;
}

server::ClosureNames ServerNode::closure_names() const {
  std::set<ChainId> chains;
  for (const auto& [id, submap] : server_.state().submaps) chains.insert(chains.end(), id.chain);
  return {robot_names(), chains};
}

}  // namespace tutti::node
