// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/followed_maps.hpp"

#include <algorithm>
#include <utility>

namespace tutti::node {
namespace {

/// The newer map takes something else for true of this chain.
bool concerns(const server::ChangeReason& reason) {
  return reason.found + reason.taken_up + reason.dropped + reason.failed + reason.recovered > 0;
}

}  // namespace

FollowedMaps::Decision FollowedMaps::take(RobotId robot, Map map, bool at_once, Timestamp now) {
  Robot& known = robots_[robot];
  Decision out{.send = at_once || known.followed.beliefs == nullptr || now - known.sent >= unchanged_every_s_,
               .changed = {}};
  if (!map.own.nodes.empty()) {
    const ChainId& chain = map.own.nodes.front().chain;
    if (nodes_of(known.followed.own, chain).empty()) {
      out.send = true;
    } else {
      const consistency::MapChange change = consistency::map_change(known.followed.own, map.own, chain);
      const auto reason = [&] { return server::reason_of_change(*known.followed.beliefs, *map.beliefs, chain); };
      if (change.is_change_of_mind()) out.changed = {robot, change, reason()};
      // The reason goes over all closures, so it is asked where nothing else decides.
      out.send = out.send || change.significance > kNoticed || concerns(reason());
    }
  }
  if (out.send)
    known = {.followed = std::move(map), .sent = now, .held = {}};
  else
    known.held = std::move(map);
  return out;
}

bool FollowedMaps::follow(RobotId robot, Timestamp now) {
  const auto found = robots_.find(robot);
  if (found == robots_.end() || !found->second.held || found->second.sent + unchanged_every_s_ > now) return false;
  found->second = {.followed = *std::move(found->second.held), .sent = now, .held = {}};
  return true;
}

std::optional<Timestamp> FollowedMaps::next_review() const {
  std::optional<Timestamp> next;
  for (const auto& [id, robot] : robots_)
    if (const Timestamp at = robot.sent + unchanged_every_s_; robot.held) next = std::min(next.value_or(at), at);
  return next;
}

}  // namespace tutti::node
