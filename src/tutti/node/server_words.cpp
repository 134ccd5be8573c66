// SPDX-License-Identifier: BSD-3-Clause
// What operators say to the server of closures.
#include <map>
#include <optional>
#include <set>
#include <string>

#include "tutti/node/server_node.hpp"
#include "tutti/node/words.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {

/// An operator's word is not a robot's or a worker's to give.
void ServerNode::receive_word(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const Status taken = take_word(envelope, now, step);
  if (!taken) refuse(envelope, taken.error().message, now, step);
}

Status ServerNode::take_word(const bus::Envelope& envelope, Timestamp now, Step& step) {
  if (envelope.from.role != bus::Endpoint::Role::viewer)
    return fail(ErrorCode::invalid, "a word on closures from a {}, which is for operators to say",
                name(envelope.from.role));
  const auto word = wire::decode_word(*envelope.bytes);
  if (!word) return tl::unexpected(word.error());
  const auto pair = closure_names().find(word->closure);
  if (!pair) return tl::unexpected(pair.error());
  const WordSet& words = server_.state().words;
  const auto known = words.find(*pair);
  const auto before = known == words.end() ? std::nullopt : std::optional(known->second);
  if (auto taken = server_.receive(*pair, *word); !taken) return taken;
  if (before == words.at(*pair)) return {};
  step.writes.push_back({"words", key_of(*pair), *envelope.bytes});
  step.tell(now, WordTaken{*pair, word->wish});
  send_jobs(std::nullopt, now, 0, config_.pairs_per_job, step);
  return {};
}

server::ClosureNames ServerNode::closure_names() const {
  std::map<RobotId, std::string> names;
  for (const auto& [robot, entry] : registry_.robots())
    if (entry.is_claimed) names[robot] = entry.status.name;
  std::set<ChainId> chains;
  for (const auto& [id, submap] : server_.state().submaps) chains.insert(chains.end(), id.chain);
  return {names, chains};
}

}  // namespace tutti::node
