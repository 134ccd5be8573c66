// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/change_watch.hpp"

#include <algorithm>
#include <utility>

namespace tutti::node {

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
  const ProxyGraph& own = map.own;
  const auto end_waiting = [&](ChangeOutcome outcome) {
    if (known.waiting) out.reports.push_back({robot, outcome, known.waiting->change, known.waiting->reason});
    known.waiting.reset();
  };
  const auto follow = [&] { known.followed = std::move(map); };
  if (own.nodes.empty() || !lone) {
    end_waiting(ChangeOutcome::stands);
    follow();
    return out;
  }
  const ChainId& chain = own.nodes.front().chain;
  const consistency::MapChange change = consistency::map_change(known.followed.own, own, chain);
  if (!change.is_change_of_mind()) {
    end_waiting(ChangeOutcome::gone);
    follow();
    return out;
  }
  server::ChangeReason reason = server::reason_of_change(*known.followed.beliefs, *map.beliefs, chain);
  reason.lone = lone(known.followed, own);
  const bool stands =
      known.waiting && consistency::map_change(known.waiting->map.own, own, chain).translation_m < change.translation_m;
  if (stands && has_stood(*known.waiting, reason.lone, now)) {
    end_waiting(ChangeOutcome::stands);
    follow();
    return out;
  }
  out.send = false;
  if (stands) {
    known.waiting->map = std::move(map);
    known.waiting->reason.lone = reason.lone;
    return out;
  }
  end_waiting(ChangeOutcome::gone);
  out.reports.push_back({robot, ChangeOutcome::waits, change, reason});
  known.waiting = {now, std::move(map), change, reason};
  return out;
}

std::optional<ChangeOfMind> ChangeWatch::follow(RobotId robot, Timestamp now) {
  const auto known = robots_.find(robot);
  if (known == robots_.end() || !known->second.waiting) return std::nullopt;
  if (!has_stood(*known->second.waiting, known->second.waiting->reason.lone, now)) return std::nullopt;
  Waiting waiting = *std::exchange(known->second.waiting, std::nullopt);
  known->second.followed = std::move(waiting.map);
  return ChangeOfMind{robot, ChangeOutcome::stands, waiting.change, waiting.reason};
}

bool ChangeWatch::has_stood(const Waiting& waiting, std::size_t lone_closures, Timestamp now) {
  return now - waiting.since >= (lone_closures == 0 ? kAnother_s : kStands_s);
}

bool ChangeWatch::anything_waits() const {
  return std::ranges::any_of(robots_, [](const auto& known) { return known.second.waiting.has_value(); });
}

}  // namespace tutti::node
