// SPDX-License-Identifier: BSD-3-Clause
// The part of ServerNode that keeps track of robots and workers and makes the mission's status.
#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "tutti/base/plain_text.hpp"
#include "tutti/localise/known_map.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::node {
namespace {

constexpr std::size_t kMostStrangersShown = 50;  // to viewers: the last heard

std::uint64_t count(const std::map<std::uint64_t, NumberSet>& sessions) {
  std::uint64_t all = 0;
  for (const auto& [session, numbers] : sessions)
    for (const auto& [begin, end] : numbers.intervals()) all += end - begin;
  return all;
}

/// How many refused submaps are the robot's: of numbers that it has used, as it reports or because a later one is in
/// the map. Others are garbage that anybody may have sent.
std::uint64_t count_refused(const Receipt& receipt, const NodeStatus& status) {
  std::uint64_t all = 0;
  for (const auto& [session, numbers] : receipt.refused) {
    std::uint64_t used = 0;
    if (const auto stored = receipt.stored.find(session); stored != receipt.stored.end())
      for (const NumberSet::Interval& interval : stored->second.intervals()) used = interval.end;
    if (session == status.session) used = std::max(used, status.submaps.value_or(0));
    for (const NumberSet::Interval& interval : numbers.intervals())
      all += std::min(interval.end, used) - std::min(interval.begin, used);
  }
  return all;
}

}  // namespace

void ServerNode::note_refusal(bus::Endpoint::Role from, bus::MessageKind kind, const std::string& why) {
  MissionStatus::Refusals& refusals = refusals_[{from, kind}];
  if (refusals.count == 0) ++changes_;
  refusals = {bus::name(from), wire::name(kind), refusals.count + 1, plain_text(why)};
}

void ServerNode::receive_status(const bus::Envelope& envelope, Timestamp now, Step& step) {
  auto status = wire::decode_status(*envelope.bytes);
  if (!status) return refuse(envelope, status.error().message, now, step);
  if (envelope.from.role == bus::Endpoint::Role::worker) {
    receive_status_of_worker(envelope.from.number, *status, now, step);
    return;
  }
  const auto robot = envelope.from.robot();
  if (!robot) return refuse(envelope, "the status of neither a robot nor a worker", now, step);
  if (const std::string why = objection_to(*robot); !why.empty())
    return refuse_robot(envelope, *status, why, now, step);
  if (const std::string why = config_.name_objection ? config_.name_objection(*robot, status->name) : ""; !why.empty())
    return refuse_robot(envelope, *status, why, now, step);
  InMap returned = status->in_map;
  status->in_map.fits.clear();  // whoever watches has them from the place book
  if (!receive_status_of_robot(*robot, *status, now, step)) return;
  note_returns(*robot, returned, now);
  if (auto row = place_book_.row_if_due(*robot, clock_s(now), status->finished)) step.writes.push_back(std::move(*row));
}

std::int64_t ServerNode::clock_s(Timestamp now) const {
  return (config_.wall_ns ? config_.wall_ns() : now.ns) / 1'000'000'000;
}

void ServerNode::note_returns(RobotId robot, const InMap& in_map, Timestamp now) {
  if (in_map.fits.empty() || !registry_.is_mapped(robot)) return;
  note_first_submap();
  const std::string why =
      place_book_.hear(robot, in_map, clock_s(now), [this](const std::string& map, const SubmapReturn& one) {
        return map == map_id_ ? objection_to(one) : std::string();
      });
  if (!why.empty()) note_refusal(bus::Endpoint::Role::robot, bus::MessageKind::status, why);
}

std::string ServerNode::objection_to(const SubmapReturn& one) const {
  const server::MapServerState& state = server_.state();
  if (!state.submaps.contains(one.submap))
    return fmt::format("how submap {} fits: the map has no such submap", to_string(one.submap));
  const auto size = state.payload_sizes.find(one.submap);
  const std::uint64_t points = size == state.payload_sizes.end() ? 0 : size->second.points;
  if (std::uint64_t{one.matched} + one.missing > points)
    return fmt::format("how submap {} fits: {} of its points matched and {} missing, it has {}", to_string(one.submap),
                       one.matched, one.missing, points);
  return {};
}

void ServerNode::note_first_submap() {
  const auto& submaps = server_.state().submaps;
  if (submaps.empty() || first_submap_ == submaps.begin()->first) return;
  const auto frame = frames_->frame(submaps.begin()->first);
  if (!frame) return;
  first_submap_ = submaps.begin()->first;
  map_id_ = localise::map_id_of(*frame);
}

void ServerNode::receive_status_of_worker(std::uint32_t number, const NodeStatus& status, Timestamp now, Step& step) {
  workers_.hear(number, status, now);
  if (!waiting_.empty() && can(status, server_.verifier().id())) ask_waiting(now, step);
  if (refinements_.waiting() && can(status, refinements_.waiting()->refiner))
    ask_for_refinement(*refinements_.take_waiting(), now, 0, step);
}

/// It learns so, once.
void ServerNode::refuse_robot(const bus::Envelope& envelope, const NodeStatus& status, const std::string& why,
                              Timestamp now, Step& step) {
  Receipt* const receipt = receipt_of(*envelope.from.robot(), now);
  const Receipt::Conflict conflict{status.session, status.start, plain_text(why)};
  if (receipt == nullptr || receipt->conflict == conflict) return note_refusal(envelope.from.role, envelope.kind, why);
  refuse(envelope, why, now, step);
  receipt->conflict = conflict;
  send_receipt(*receipt, step);
}

bool ServerNode::receive_status_of_robot(RobotId robot, const NodeStatus& status, Timestamp now, Step& step) {
  const auto before = registry_.owner(robot);
  const auto heard = registry_.hear(robot, status, now);
  if (heard.must_be_stored) step.writes.push_back({"meta", RobotRegistry::key(robot), registry_.row(robot)});
  Receipt* const known_receipt = receipt_of(robot, now);
  if (known_receipt == nullptr) return false;
  Receipt& receipt = *known_receipt;
  const auto owner = registry_.owner(robot);
  const Receipt old = receipt;
  if (owner) receipt.owner_session = owner->session;
  if (!heard.accepted) {
    note_refusal(bus::Endpoint::Role::robot, bus::MessageKind::status, heard.why);
    receipt.conflict = {status.session, status.start, plain_text(heard.why)};
    if (receipt.conflict != old.conflict) step.emit(now, RobotRefused{robot, status.session, heard.why});
  } else {
    if (receipt.conflict && receipt.conflict->session == status.session && receipt.conflict->start == status.start)
      receipt.conflict.reset();
    if (before != owner) step.emit(now, RobotJoined{robot, status.name, status.session});
  }
  const bool is_due = heard.accepted && receipts_.waits_too_long(robot, status, now);
  if (receipt != old) ++changes_;
  if (receipt != old || is_due) send_receipt(receipt, step);
  return heard.accepted;
}

/// The last heard of those without submaps, who are there.
std::set<RobotId> ServerNode::strangers_there(Timestamp now) const {
  std::vector<std::pair<Timestamp, RobotId>> heard;
  for (const auto& [robot, known] : registry_.robots())
    if (!robots_.contains(robot) && known.last_seen && now - *known.last_seen < Receipts::kStrangerIsGone_s)
      heard.emplace_back(*known.last_seen, robot);
  std::ranges::sort(heard, std::greater());
  std::set<RobotId> there;
  for (std::size_t i = 0; i < std::min(heard.size(), kMostStrangersShown); ++i) there.insert(heard[i].second);
  return there;
}

MissionStatus ServerNode::mission_status(Timestamp now) const {
  const server::MapServerState& state = server_.state();
  const MapCounts made = stored_counts_.value_or(MapCounts());
  const std::uint64_t waiting = waiting_.size() + (refinements_.waiting() ? 1 : 0);
  MissionStatus out{.time = now,
                    .epoch = state.epoch,
                    .incarnation = config_.incarnation,
                    .revision = state.revision,
                    .submaps = state.submaps.size(),
                    .closures = made.closures,
                    .components = made.components,
                    .pending_jobs = jobs_.size() + failed_.waiting() + (refinements_.next_due() ? 1 : 0) +
                                    (settle_at_ ? 1 : 0) + waiting,
                    .has_news = server_.has_news()};
  out.verifier = to_string(state.verifier);
  out.former_pairs = server_.former_pairs();
  out.retired = state.retired.size();
  out.waiting = waiting;
  if (waiting > 0) out.why_waiting = why_waiting_;
  std::set<RobotId> robots = robots_;
  robots.merge(strangers_there(now));
  for (const RobotId robot : robots) {
    if (out.robots.size() == MissionStatus::kMostRobots) break;
    MissionStatus::Robot& entry = out.robots.emplace_back();
    entry.robot = robot;
    if (const Receipt* const known_receipt = receipts_.find(robot)) {
      entry.submaps = count(known_receipt->stored);
      const auto known = registry_.robots().find(robot);
      entry.refused =
          count_refused(*known_receipt, known == registry_.robots().end() ? NodeStatus{} : known->second.status);
      entry.unread = count(known_receipt->unread);
    }
    if (const auto found = registry_.robots().find(robot); found != registry_.robots().end()) {
      const RobotRegistry::Robot& known = found->second;
      entry.last_seen = known.last_seen;
      entry.last_update = known.last_update;
      entry.status = known.status;
      if (known.last_conflict && now - *known.last_conflict < RobotRegistry::kOwnerIsThere_s)
        entry.conflict = plain_text(known.conflict);
    }
    if (entry.status.name.empty())
      entry.status.name =
          robot.value < config_.names.size() ? config_.names[robot.value] : default_name(bus::Endpoint::of(robot));
  }
  for (const auto& [number, worker] : workers_.all()) out.workers.push_back(worker);
  for (const auto& [from, refusals] : refusals_) out.refusals.push_back(refusals);
  out.decisions = decisions_.all();
  std::optional<server::ClosureNames> names;
  place_book_.fill(out, clock_s(now), map_id_, [&](SubmapId submap) {
    if (!names) names = closure_names();
    return names->of(submap);
  });
  return out;
}

}  // namespace tutti::node
