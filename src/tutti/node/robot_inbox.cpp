// SPDX-License-Identifier: BSD-3-Clause
// The part of RobotNode that takes the server's messages: graphs, and receipts of which submaps it has.
#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "tutti/base/content_hash.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/node/robot_tables.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {

using namespace robot_tables;  // NOLINT

Step RobotNode::receive(const bus::Envelope& envelope, Timestamp now) {
  Step step;
  if (envelope.kind == bus::MessageKind::proxy_graph || envelope.kind == bus::MessageKind::proxy_graph_delta)
    receive_graph(envelope, now, step);
  else if (envelope.kind == bus::MessageKind::receipt)
    receive_receipt(envelope, now, step);
  else
    step.emit(now, MessageRefused{envelope.from, envelope.kind, "not for a robot"});
  return step;
}

void RobotNode::refuse(const bus::Envelope& envelope, const Error& error, Timestamp now, Step& step) {
  step.emit(now, MessageRefused{envelope.from, envelope.kind, error.message});
  if (error.code != ErrorCode::unsupported) return;
  Unread& unread = unread_[envelope.kind];
  ++unread.count;
  unread.why = error.message;
}

void RobotNode::remember_incarnations(Step& step) const {
  if (config_.keeps_state)
    step.writes.push_back({kMeta, kIncarnations, storage::key_of({graph_incarnation_, receipt_incarnation_})});
}

/// A server that has started again counts on from where its map was: an older one than the robot has heard of is
/// another map. The newest of a kind comes last (bus::Delivery::retained), so that no start is heard after a later one
/// for long.
void RobotNode::receive_graph(const bus::Envelope& envelope, Timestamp now, Step& step) {
  auto graph = read_graph(envelope);
  if (!graph) return refuse(envelope, graph.error(), now, step);
  unread_.erase(envelope.kind);
  if (!*graph) return;
  newest_ = std::move(*graph);
  const ProxyGraph& heard = newest_->graph;
  if (heard.incarnation != graph_incarnation_) {
    graph_incarnation_ = heard.incarnation;
    remember_incarnations(step);
    if (heard.age() < agent_.map_age()) agent_.forget_map_age();
    mapped_age_ = {};
  }
  if (goes_on_behind(heard)) {
    step.emit(now, MessageRefused{envelope.from, envelope.kind,
                                  fmt::format("the map of revision {}, heard before: the server goes on from {}",
                                              agent_.map_age().second, heard.revision)});
    agent_.forget_map_age();
    mapped_age_ = {};
  }
  if (heard.age() >= mapped_age_) {
    mapped_age_ = heard.age();
    const auto own = nodes_of(heard, agent_.chain());
    mapped_until_ = own.empty() ? kFirstTimestamp : own.back().stamp;
  }
  if (agent_.is_news(heard)) follow(*newest_, now, step);
}

void RobotNode::follow(const ProxyGraphMessage& graph, Timestamp now, Step& step) {
  if (config_.keeps_state) remember(HeardGraph{wire::encode(graph)}, now, step);
  write_journal(step);  // what is reported of it is true
  step.emit(now, RobotUpdated{agent_.robot(), agent_.receive(graph, observer_)});
  note(std::get<RobotUpdated>(step.events.back().what).summary);
  updated_ = now;
}

/// One graph in the server's name, with a revision that it will never have, would be the last that this robot believes.
/// A graph that is only late comes once, and the newest of a kind last.
bool RobotNode::goes_on_behind(const ProxyGraph& heard) {
  constexpr unsigned kGoesOn = 3;
  if (heard.age() >= agent_.map_age()) {
    older_ = 0;
    return false;
  }
  if (older_ > 0 && heard.age() <= older_age_) return false;
  older_age_ = heard.age();
  if (++older_ < kGoesOn) return false;
  older_ = 0;
  return true;
}

bool RobotNode::is_whole_in_map() const {
  const auto& keyframes = agent_.keyframes();
  std::size_t last = keyframes.size();
  while (last > 0 && !keyframes[last - 1].representative) --last;
  return last == 0 || keyframes[last - 1].stamp <= mapped_until_;
}

void RobotNode::note(const robot::UpdateSummary& summary) {
  alerts_ = static_cast<std::uint64_t>(
      std::ranges::count_if(summary.explanation.origins, [](const auto& origin) { return origin.alert; }));
}

/// The graph of a message, of a delta with the last whole one, both of which are kept. Null where that has not come.
Result<std::shared_ptr<const ProxyGraphMessage>> RobotNode::read_graph(const bus::Envelope& envelope) {
  const auto with_base = [&](const std::string& delta) -> Result<std::shared_ptr<const ProxyGraphMessage>> {
    auto graph = wire::decode_delta(delta, base_ ? base_->graph : ProxyGraph{});
    if (!graph) return tl::unexpected(graph.error());
    return *graph ? std::make_shared<const ProxyGraphMessage>(std::move(**graph)) : nullptr;
  };
  if (envelope.kind == bus::MessageKind::proxy_graph_delta) {
    auto graph = with_base(*envelope.bytes);
    if (graph) delta_ = envelope.bytes;
    return graph;
  }
  auto message = wire::decode_proxy_graph(*envelope.bytes);
  if (!message) return tl::unexpected(message.error());
  base_ = std::make_shared<const ProxyGraphMessage>(std::move(*message));
  const auto newer = delta_ ? with_base(*delta_) : nullptr;
  return newer && *newer ? *newer : base_;
}

void RobotNode::receive_receipt(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const auto receipt = wire::decode_receipt(*envelope.bytes);
  if (!receipt) return refuse(envelope, receipt.error(), now, step);
  unread_.erase(envelope.kind);
  if (receipt->robot != agent_.robot())
    return step.emit(now, MessageRefused{envelope.from, envelope.kind, "a receipt for another robot"});
  const bool has_started = receipt->incarnation != receipt_incarnation_;
  if (has_started) note_start(receipt->incarnation, step);
  take_back(*receipt, has_started, now, step);
  std::vector<SubmapId> known;
  std::set<std::uint64_t> foreign;  // sessions
  for (const auto& [id, bytes] : uplink_.submaps()) {
    const bool is_refused = is_refused_as_it_is(id, *receipt);
    if (is_refused && receipt->contains(id)) {
      foreign.insert(id.chain.session);
      continue;
    }
    if (is_refused)
      step.emit(now, MessageRefused{bus::Endpoint::of(agent_.robot()), bus::MessageKind::submap,
                                    fmt::format("submap {} is refused by the server, which last reported: {}",
                                                to_string(id), receipt->why_refused)});
    if (is_refused || receipt->contains(id))
      known.push_back(id);
    else if (receipt->leaves_unread(id))
      uplink_.park(id);
  }
  for (const SubmapId id : known) archive(id, !receipt->contains(id), step);
  note_foreign(foreign, now, step);
  note_conflict(*receipt, now, step);
  send_submaps(now, {}, step);
}

void RobotNode::note_start(std::uint32_t incarnation, Step& step) {
  receipt_incarnation_ = incarnation;
  remember_incarnations(step);
  uplink_.release();
  hold_foreign();
}

/// A server that runs on forgets nothing: what it named as stored and names no more, somebody else named in its name.
/// It may forget refusals, for its list is bounded, unless it has started again.
void RobotNode::take_back(const Receipt& receipt, bool has_started, Timestamp now, Step& step) {
  std::vector<SubmapId> forgotten;
  for (const auto& [id, bytes] : archive_) {
    if (receipt.contains(id)) continue;
    if (has_started ? !is_refused_as_it_is(id, receipt) : !refused_.contains(id)) forgotten.push_back(id);
  }
  if (forgotten.empty()) return;
  for (const SubmapId id : forgotten) {
    const auto found = archive_.find(id);
    archive_bytes_ -= found->second;
    uplink_.add(id, found->second);
    archive_.erase(found);
    refused_.erase(id);
    step.writes.push_back({kArchive, key_of(id), std::nullopt});
  }
  step.emit(now, SubmapsForgotten{agent_.robot(), forgotten.size()});
}

/// The oldest make room for it.
void RobotNode::archive(SubmapId id, bool is_refused, Step& step) {
  const std::size_t bytes = uplink_.submaps().at(id);
  uplink_.remove(id);
  archive_.emplace(id, bytes);
  archive_bytes_ += bytes;
  if (is_refused) refused_.insert(id);
  step.writes.push_back({kArchive, key_of(id), is_refused ? kRefused : ""});
  while (archive_bytes_ > config_.max_archive_bytes) {
    const auto oldest = archive_.begin();
    for (const char* table : {kOutbox, kArchive}) step.writes.push_back({table, key_of(oldest->first), std::nullopt});
    archive_bytes_ -= oldest->second;
    refused_.erase(oldest->first);
    archive_.erase(oldest);
  }
}

/// And not something else that came under its id.
bool RobotNode::is_refused_as_it_is(SubmapId id, const Receipt& receipt) const {
  const auto is_of_id = [&](const Receipt::Refusal& of) {
    return of.session == id.chain.session && of.index == id.index;
  };
  if (std::ranges::none_of(receipt.refusals, is_of_id)) return false;
  const auto row = store_.read(kOutbox, key_of(id));
  return row && *row && receipt.refuses(id, content_hash(**row));
}

}  // namespace tutti::node
