// SPDX-License-Identifier: BSD-3-Clause
// The part of ServerNode that takes operators' messages: decisions on closures, and marks.
#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tutti/base/plain_text.hpp"
#include "tutti/bus/bus_credentials.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/marks.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"

namespace tutti::node {
namespace {

constexpr std::size_t kLongestName = 64;  // of `tutti pki`

/// Whose word it is, whatever it claims. The page has asked who decides there.
std::string author_of(const bus::Envelope& envelope, const std::string& claimed) {
  const bool may_claim = envelope.user.empty() || (envelope.user == bus::kPageUser && !claimed.empty());
  return may_claim ? claimed : plain_text(envelope.user, kLongestName);
}

}  // namespace

/// It is not a robot's or a worker's to give.
void ServerNode::receive_order(const bus::Envelope& envelope, Timestamp now, Step& step) {
  if (envelope.from.role != bus::Endpoint::Role::viewer)
    return refuse(
        envelope,
        fmt::format("a decision on closures from a {}, which only operators may make", name(envelope.from.role)), now,
        step);
  if (wire::kind_of(*envelope.bytes) == bus::MessageKind::mark) return receive_mark(envelope, now, step);
  receive_decision(envelope, now, step);
}

void ServerNode::receive_mark(const bus::Envelope& envelope, Timestamp now, Step& step) {
  auto order = wire::decode_mark_order(*envelope.bytes);
  if (!order) return refuse(envelope, order.error().message, now, step);
  if (decisions_.is_stored(*envelope.bytes)) return note_decision(*envelope.bytes, {});  // once more
  if (order->mark) order->mark->by = author_of(envelope, order->mark->by);
  auto rows = follow(*order, marks_);
  if (rows) std::ranges::move(*rows, std::back_inserter(step.writes));
  note_decision(*envelope.bytes, rows ? "" : rows.error().message);
}

void ServerNode::receive_decision(const bus::Envelope& envelope, Timestamp now, Step& step) {
  auto decision = wire::decode_decision(*envelope.bytes);
  if (!decision) return refuse(envelope, decision.error().message, now, step);
  decision->by = author_of(envelope, decision->by);
  const std::int64_t now_ns = config_.wall_ns ? config_.wall_ns() : 0;
  decision->taken_ns = now_ns;
  if (decision->counts_from_ns() < decision->given_ns && decisions_.is_stored(*envelope.bytes))
    return note_decision(*envelope.bytes, {});  // once more: it is not decided anew, later
  const auto is_late = take_decision(*decision, now, step);
  if (!is_late) refuse(envelope, is_late.error().message, now, step);
  note_decision(*envelope.bytes, !is_late ? is_late.error().message : *is_late ? "a later decision on it holds" : "");
}

Result<bool> ServerNode::take_decision(const ClosureDecision& decision, Timestamp now, Step& step) {
  const auto pair = closure_names().find(decision.closure);
  if (!pair) return tl::unexpected(pair.error());
  const DecisionSet& decisions = server_.state().decisions;
  const auto known = decisions.find(*pair);
  const auto before = known == decisions.end() ? std::nullopt : std::optional(known->second);
  if (auto taken = server_.receive(*pair, decision); !taken) return tl::unexpected(taken.error());
  if (before == decisions.at(*pair)) {
    ClosureDecision same = with_sessions(decision, *pair);
    same.taken_ns = before->taken_ns;
    return before != same;
  }
  step.writes.push_back({map_tables::kDecisions, key_of(*pair), wire::encode(decision)});
  step.emit(now, DecisionTaken{*pair, decision.wish});
  operator_decided_ = true;
  send_jobs(std::nullopt, now, 0, config_.pairs_per_job, step);
  return false;
}

void ServerNode::note_decision(const std::string& frame, const std::string& why) {
  decisions_.note(frame, why);
  ++changes_;
}

void ServerNode::recall_decisions() {
  std::vector<ClosureDecision> given;
  for (const auto& [pair, decision] : server_.state().decisions) given.push_back(decision);
  std::ranges::sort(given, {}, &ClosureDecision::counts_from_ns);
  for (ClosureDecision& decision : given) {
    decision.taken_ns = 0;  // as it was sent
    note_decision(wire::encode(decision), {});
  }
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
