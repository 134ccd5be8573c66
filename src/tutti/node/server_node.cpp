// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/server_node.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/node/internal/opened_map.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/marks.hpp"
#include "tutti/node/meta_keys.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::node {
namespace {

/// The prefix of the names of all jobs of a start, which no other map has. An older map that was put back counts its
/// starts once more.
std::string names_of_jobs(std::uint64_t epoch, std::uint64_t start, std::uint32_t incarnation) {
  const std::string prefix = fmt::format("{}/{}/", epoch, start);
  return incarnation == 0 ? prefix : fmt::format("{}{:08x}/", prefix, incarnation);
}

bus::MessageKind kind_of(std::string_view table) {
  if (table == map_tables::kSubmaps) return bus::MessageKind::submap;
  if (table == map_tables::kDecisions) return bus::MessageKind::decision;
  if (table == map_tables::kMeta) return bus::MessageKind::receipt;
  return table == map_tables::kVerdicts ? bus::MessageKind::verdict : bus::MessageKind::verdicts;
}

}  // namespace

Result<std::unique_ptr<ServerNode>> ServerNode::open(std::set<RobotId> robots,
                                                     std::shared_ptr<const server::ClosureVerifier> verifier,
                                                     const ServerNodeConfig& config, std::uint64_t epoch,
                                                     const storage::TableStore& store) {
  TUTTI_CHECK(verifier != nullptr && epoch > 0, "no verifier or no epoch");
  TUTTI_CHECK(config.pairs_per_job > 0, "jobs of no pairs");
  auto opened = OpenedMap::from(store, verifier->id());
  if (!opened) return tl::unexpected(opened.error());
  if (opened->epoch > 0) epoch = opened->epoch;
  // Verdicts on the submaps of a map's robots come also where these robots are not of this mission.
  for (const auto& [robot, receipt] : opened->receipts) robots.insert(robot);
  if (config.accepts_others)
    for (const auto& [robot, entry] : opened->registry.robots()) robots.insert(robot);
  auto marks = read_marks(store);
  if (!marks) return tl::unexpected(marks.error());
  std::unique_ptr<ServerNode> node(new ServerNode(std::move(robots), std::move(verifier), config, epoch,
                                                  SubmapFrames::of(store), std::move(*opened)));
  node->marks_ = std::move(*marks);
  bool has_returns = false;
  const Status returned = each_row_of(store, kReturnedPrefix, [&](std::string_view key, std::string_view row) {
    node->place_book_.restore(key, row);
    has_returns = true;
    return Status();
  });
  if (!returned) return tl::unexpected(returned.error());
  if (has_returns) node->note_first_submap();  // else no submap's bytes are read
  return node;
}

ServerNode::ServerNode(std::set<RobotId> robots, std::shared_ptr<const server::ClosureVerifier> verifier,
                       const ServerNodeConfig& config, std::uint64_t epoch, std::shared_ptr<SubmapFrames> frames,
                       OpenedMap opened)
    : robots_(robots),
      config_(config),
      frames_(frames),
      server_(std::move(robots), std::move(verifier), std::move(frames), config.server, epoch, std::move(opened.state)),
      receipts_(std::move(opened.receipts)),
      registry_(std::move(opened.registry)),
      unread_rows_(std::move(opened.unread_rows)),
      start_(opened.start + 1),
      jobs_(names_of_jobs(server_.state().epoch, start_, config.incarnation), config.job_timeout_s),
      failed_(config.job_timeout_s, config.most_tries),
      refinements_(config.job_timeout_s, config.most_tries),
      had_news_(opened.news),
      pacer_({config.server.update_least_s, config.server.update_share}, opened.last_update),
      stored_counts_(opened.counts) {
  if (config.refiner != nullptr) server_.refine_with(config.refiner);
}

storage::Write ServerNode::meta() const {
  const server::MapServerState& state = server_.state();
  return to_row(MapMeta{state.epoch, state.revision, server_.has_news(), start_});
}

Step ServerNode::resume(Timestamp now) {
  Step step;
  registry_.start(now);
  for (const auto& [robot, receipt] : receipts_.members())
    if (const auto owner = registry_.owner(robot)) receipts_.of_member(robot).owner_session = owner->session;
  const bool is_whole = server_.state().revision > 0 && !had_news_;
  if (is_whole) {
    server_.nothing_is_new();
    compute_at_ = now;
  }
  if (server_.has_news()) timer_ = pacer_.earliest(now);
  step.writes.push_back(meta());
  step.writes.push_back(to_row(config_.server));
  keep_places(step);
  emit_unread_rows(now, step);
  recall_decisions();
  for (const auto& [robot, receipt] : receipts_.members()) send_receipt(robot, step);
  send_jobs(std::nullopt, now, 0, config_.pairs_per_job, step);
  note_settling(now);
  return step;
}

Step ServerNode::receive(const bus::Envelope& envelope, Timestamp now) {
  Step step;
  const bool before = server_.has_news();
  if (envelope.kind == bus::MessageKind::submap)
    receive_submap(envelope, now, step);
  else if (envelope.kind == bus::MessageKind::verdicts)
    receive_verdicts(envelope, now, step);
  else if (envelope.kind == bus::MessageKind::refinement)
    receive_refinement(envelope, now, step);
  else if (envelope.kind == bus::MessageKind::submap_request)
    send_copies(envelope, now, step);
  else if (envelope.kind == bus::MessageKind::status)
    receive_status(envelope, now, step);
  else if (envelope.kind == bus::MessageKind::decision)
    receive_order(envelope, now, step);
  else if (envelope.kind == bus::MessageKind::job && envelope.from == bus::Endpoint::any_worker())
    receive_returned_job(envelope, now, step);
  else if (envelope.kind == bus::MessageKind::refinement_job && envelope.from == bus::Endpoint::any_worker())
    receive_returned_refinement(envelope, now, step);
  else
    refuse(envelope, "not for a server", now, step);
  for (const Error& error : server_.take_late_errors())
    step.emit(now, MessageRefused{envelope.from, bus::MessageKind::verdicts, error.message});
  note_news(now, before, step);
  return step;
}

Step ServerNode::put_aside(const bus::Envelope& envelope, const std::string& why, Timestamp now) {
  Step step;
  refuse(envelope, why, now, step);
  return step;
}

void ServerNode::note_news(Timestamp now, bool before, Step& step) {
  if (server_.has_news() && operator_decided_) timer_ = pacer_.earliest(now, true);
  if (before == server_.has_news()) return;
  compute_at_.reset();  // the map with the news takes its place
  timer_ = pacer_.earliest(now, operator_decided_);
  step.writes.push_back(meta());
}

void ServerNode::refuse(const bus::Envelope& envelope, const std::string& why, Timestamp now, Step& step) {
  step.emit(now, MessageRefused{envelope.from, envelope.kind, why});
  note_refusal(envelope.from.role, envelope.kind, why);
}

std::string ServerNode::objection_to(RobotId robot) const {
  if (robots_.contains(robot)) return {};
  if (!config_.accepts_others) return fmt::format("robot {} is none of the mission's {}", robot.value, robots_.size());
  if (robots_.size() >= ProxyGraph::kMostChains)
    return fmt::format("the map has {} robots already and takes no other one", robots_.size());
  return {};
}

bool ServerNode::admit(RobotId robot) {
  if (!robots_.insert(robot).second) return false;
  server_.add_robot(robot);
  receipts_.admit(robot);
  return true;
}

void ServerNode::dismiss(RobotId robot, Timestamp now) {
  robots_.erase(robot);
  server_.remove_robot(robot);
  receipts_.dismiss(robot, now);
}

Receipt* ServerNode::receipt_of(RobotId robot, Timestamp now) {
  return receipts_.of_anybody(robot, robots_.contains(robot), now);
}

void ServerNode::receive_submap(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const Status taken = take_submap(envelope, now, step);
  if (taken) return;
  refuse(envelope, taken.error().message, now, step);
  const auto id = submap_of(envelope.id);
  if (!id || id->chain.robot != envelope.from.robot() || !objection_to(id->chain.robot).empty()) return;
  if (taken.error().code == ErrorCode::unsupported) return note_unread(*id, now, step);
  const bool may_be_good_later = taken.error().code == ErrorCode::io;
  if (!may_be_good_later) note_refused(*id, envelope, taken.error().message, now, step);
}

Status ServerNode::take_submap(const bus::Envelope& envelope, Timestamp now, Step& step) {
  const auto message = wire::decode_submap(*envelope.bytes);
  if (!message) return tl::unexpected(message.error());
  const SubmapId id = message->submap.id;
  if (envelope.from.robot() != id.chain.robot)
    return fail(ErrorCode::unknown_robot, "submap {} from somebody else", to_string(id));
  if (submap_of(envelope.id) != id)
    return fail(ErrorCode::invalid, "submap {} in a message with the id '{}'", to_string(id), envelope.id);
  if (const std::string why = objection_to(id.chain.robot); !why.empty())
    return fail(ErrorCode::unknown_robot, "submap {}: {}", to_string(id), why);
  const bool is_new = !server_.state().submaps.contains(id);
  if (!is_new) {
    const auto stored = frames_->find(id);
    if (!stored) return tl::unexpected(stored.error());
    if (!*stored)
      return {};  // a bad link has brought it twice before the first one's step, with its receipt, is stored
    const bool is_whole = !server_.state().retired.contains(id);  // else it is compared by what is left of it
    if (is_whole && **stored != *envelope.bytes)
      return fail(ErrorCode::invalid, "submap {} comes with other content than the one in the map, which stays",
                  to_string(id));
  }
  const bool is_first = admit(id.chain.robot);
  if (auto taken = server_.receive(*message); !taken) {
    if (is_first) dismiss(id.chain.robot, now);
    return taken;
  }
  if (is_new) {
    Receipt& receipt = receipts_.of_member(id.chain.robot);
    receipt.stored[id.chain.session].insert(id.index);
    forget_unread(id, receipt);
    if (receipt.refuses(id)) {  // something else that came under its id
      receipt.forget_refusals(id);
      step.writes.push_back(refusals_row(receipt));
    }
    if (registry_.note_session(id.chain))
      step.writes.push_back({map_tables::kMeta, RobotRegistry::key(id.chain.robot), registry_.row(id.chain.robot)});
    step.writes.push_back({map_tables::kSubmaps, key_of(id), *envelope.bytes});
    keep_places(step);
    step.emit(now, SubmapStored{id});
  }
  send_receipt(id.chain.robot, step);
  send_jobs(id, now, 0, config_.pairs_per_job, step);
  return {};
}

void ServerNode::keep_places(Step& step) {
  const server::PlaceSet& places = server_.state().places;
  for (const SubmapId& id : server_.take_places()) {
    const auto place = places.find(id);
    step.writes.push_back(place != places.end() ? to_row(id, place->second)
                                                : storage::Write{map_tables::kMeta, place_key(id), std::nullopt});
  }
}

void ServerNode::emit_unread_rows(Timestamp now, Step& step) {
  for (const auto& [table, rows] : unread_rows_) {
    const std::string why =
        fmt::format("{} rows of the map's table '{}' are left as they are: {}", rows.count, table, rows.why);
    step.emit(now, MessageRefused{bus::Endpoint::server(), kind_of(table), why});
    note_refusal(bus::Endpoint::Role::server, kind_of(table), why);
  }
}

/// A robot that nobody knows learns so too, and is none of the mission's for that.
void ServerNode::note_unread(SubmapId id, Timestamp now, Step& step) {
  Receipt* const receipt = receipt_of(id.chain.robot, now);
  if (receipt == nullptr) return;
  node::note_unread(id, *receipt);
  send_receipt(*receipt, step);
}

void ServerNode::note_refused(SubmapId id, const bus::Envelope& envelope, const std::string& why, Timestamp now,
                              Step& step) {
  Receipt* const receipt = receipt_of(id.chain.robot, now);
  if (receipt == nullptr) return;
  if (node::note_refused(id, *envelope.bytes, why, *receipt) && robots_.contains(id.chain.robot))
    step.writes.push_back(refusals_row(*receipt));
  send_receipt(*receipt, step);
}

/// Sends a worker the copies that it asked for, of jobs that are out; it asks again for those that it does not get. A
/// copy without a frame means that the map does not have it, or no job that is out needs it.
void ServerNode::send_copies(const bus::Envelope& envelope, Timestamp now, Step& step) {
  if (envelope.from.role != bus::Endpoint::Role::worker) return refuse(envelope, "only workers get copies", now, step);
  const auto request = wire::decode_submap_request(*envelope.bytes);
  if (!request) return refuse(envelope, request.error().message, now, step);
  for (std::size_t i = 0; i < std::min(request->submaps.size(), WorkerNode::kMostAsked); ++i) {
    const bool is_given = jobs_.needs(request->submaps[i]);
    if (!is_given) note_refusal(envelope.from.role, envelope.kind, "of a submap that no job needs which is out");
    auto frame = is_given ? frames_->find(request->submaps[i]) : Result<std::optional<std::string>>(std::nullopt);
    if (!frame) return refuse(envelope, frame.error().message, now, step);
    step.messages.push_back({bus::Endpoint::server(),
                             envelope.from,
                             bus::MessageKind::submap_copy,
                             {},
                             std::make_shared<const std::string>(
                                 wire::encode(SubmapCopy{request->submaps[i], std::move(*frame).value_or("")}))});
  }
}

void ServerNode::send_receipt(RobotId robot, Step& step) const { send_receipt(receipts_.members().at(robot), step); }

void ServerNode::send_receipt(Receipt receipt, Step& step) const {
  receipt.incarnation = config_.incarnation;
  step.messages.push_back(
      to_robot(receipt.robot, bus::MessageKind::receipt, std::make_shared<const std::string>(wire::encode(receipt))));
}

}  // namespace tutti::node
