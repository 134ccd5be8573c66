// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/change_watch.hpp"

#include <algorithm>
#include <utility>

namespace tutti::node {
namespace {

using consistency::MapChange;

/// The newer map takes something else for true of this chain.
bool concerns(const server::ChangeReason& reason) {
  return reason.found + reason.taken_up + reason.dropped + reason.failed + reason.recovered > 0;
}

/// It has another submap of the chain, or concerns it.
bool has_more(const ChangeWatch::Map& older, const ChangeWatch::Map& newer, const ChainId& chain) {
  return newer.own.nodes.back().stamp > older.own.nodes.back().stamp ||
         concerns(server::reason_of_change(*older.beliefs, *newer.beliefs, chain));
}

/// For how long a change waits for a second witness where nothing but one place says so, and odometry says something
/// else.
double patience_s(const server::ChangeReason& reason) {
  return reason.lone > 0 && reason.failed > 0 ? ChangeWatch::kWitness_s : ChangeWatch::kStands_s;
}

}  // namespace

const char* to_string(ChangeOutcome outcome) {
  switch (outcome) {
    case ChangeOutcome::waits:
      return "waits";
    case ChangeOutcome::stands:
      return "stands";
    case ChangeOutcome::gone:
      return "gone";
  }
  return "";
}

ChangeWatch::Decision ChangeWatch::take(RobotId robot, Map map, const LoneClosures& lone, Timestamp now) {
  Decision out;
  Robot& known = robots_[robot];
  const auto end_waiting = [&](ChangeOutcome outcome) {
    if (known.waiting) out.reports.push_back({robot, outcome, known.waiting->change, known.waiting->reason});
    known.waiting.reset();
  };
  const auto send = [&] {
    known.followed = std::move(map);
    known.sent = now;
    known.held.reset();
  };
  const bool is_overdue = known.followed.beliefs == nullptr || now - known.sent >= kAnyway_s;
  const ProxyGraph& own = map.own;
  if (own.nodes.empty() || !lone || nodes_of(known.followed.own, own.nodes.front().chain).empty()) {
    end_waiting(ChangeOutcome::stands);
    if (out.send = !own.nodes.empty() || !lone || is_overdue; out.send)
      send();
    else
      known.held = std::move(map);
    return out;
  }
  const ChainId& chain = own.nodes.front().chain;
  const MapChange change = consistency::map_change(known.followed.own, own, chain);
  if (!change.is_change_of_mind()) {
    end_waiting(ChangeOutcome::gone);
    out.send = is_overdue || change.significance > kNoticed ||
               concerns(server::reason_of_change(*known.followed.beliefs, *map.beliefs, chain));
  } else {
    out.send = stands(known, map, change, lone, now, robot, out.reports);
    if (out.send) end_waiting(ChangeOutcome::stands);
  }
  if (out.send)
    send();
  else
    known.held = std::move(map);
  return out;
}

bool ChangeWatch::stands(Robot& robot, const Map& map, const MapChange& change, const LoneClosures& lone, Timestamp now,
                         RobotId id, std::vector<ChangeOfMind>& reports) {
  const ChainId& chain = map.own.nodes.front().chain;
  const bool is_same = robot.waiting && consistency::map_change(robot.waiting->map.own, map.own, chain).translation_m <
                                            change.translation_m;
  if (is_same && !has_more(robot.waiting->map, map, chain))
    return now - robot.waiting->since >= patience_s(robot.waiting->reason);
  server::ChangeReason reason = server::reason_of_change(*robot.followed.beliefs, *map.beliefs, chain);
  reason.lone = lone(robot.followed, map.own);
  if (is_same) {
    robot.waiting->map = map;
    robot.waiting->reason.lone = reason.lone;
    robot.waiting->reason.failed = reason.failed;
    const double patience = patience_s(reason);
    return patience == kStands_s || now - robot.waiting->since >= patience;
  }
  if (robot.waiting) reports.push_back({id, ChangeOutcome::gone, robot.waiting->change, robot.waiting->reason});
  reports.push_back({id, ChangeOutcome::waits, change, reason});
  robot.waiting = {now, map, change, reason};
  return false;
}

std::optional<Timestamp> ChangeWatch::due(const Robot& robot) {
  if (!robot.held) return std::nullopt;
  if (!robot.waiting) return robot.sent + kAnyway_s;
  return robot.waiting->since + patience_s(robot.waiting->reason);
}

std::optional<ChangeWatch::Late> ChangeWatch::follow(RobotId robot, Timestamp now) {
  const auto found = robots_.find(robot);
  if (found == robots_.end()) return std::nullopt;
  Robot& known = found->second;
  if (const auto at = due(known); !at || *at > now) return std::nullopt;
  Late out;
  if (const auto waiting = std::exchange(known.waiting, std::nullopt))
    out.report = ChangeOfMind{robot, ChangeOutcome::stands, waiting->change, waiting->reason};
  known.followed = *std::exchange(known.held, std::nullopt);
  known.sent = now;
  return out;
}

std::optional<Timestamp> ChangeWatch::next_review() const {
  std::optional<Timestamp> next;
  for (const auto& [id, robot] : robots_)
    if (const auto at = due(robot)) next = std::min(next.value_or(*at), *at);
  return next;
}

}  // namespace tutti::node
