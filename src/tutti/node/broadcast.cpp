// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/broadcast.hpp"

#include <string>
#include <utility>

#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {

bus::Envelope to_robot(RobotId robot, bus::MessageKind kind, std::shared_ptr<const std::string> bytes) {
  return {bus::Endpoint::server(), bus::Endpoint::of(robot), kind, {}, std::move(bytes)};
}

void Broadcast::send(ProxyGraphMessage map, const std::map<RobotId, std::string>& names,
                     std::shared_ptr<const server::Beliefs> beliefs, const std::set<RobotId>& robots, bool at_once,
                     Timestamp now, Step& step) {
  for (LastSeen& seen : map.graph.last_seen)
    if (const auto found = names.find(seen.chain.robot); found != names.end()) seen.name = found->second;
  last_ = std::make_shared<const ProxyGraphMessage>(std::move(map));
  std::shared_ptr<const std::string> whole;
  for (const RobotId robot : robots) {
    ProxyGraph own = consistency::own_part(last_->graph, robot);
    const FollowedMaps::Decision decision = followed_.take(robot, {own, beliefs}, at_once, now);
    if (decision.send) send_last(robot, std::move(own), whole, step);
    if (decision.changed) step.emit(now, *decision.changed);
  }
}

void Broadcast::send_waiting(const std::set<RobotId>& robots, Timestamp now, Step& step) {
  std::shared_ptr<const std::string> whole;
  for (const RobotId robot : robots)
    if (followed_.follow(robot, now)) send_last(robot, consistency::own_part(last_->graph, robot), whole, step);
}

void Broadcast::send_last(RobotId robot, ProxyGraph own, std::shared_ptr<const std::string>& whole, Step& step) {
  if (!to_all_) {
    step.messages.push_back(own_graph(robot, std::move(own)));
    return;
  }
  if (whole == nullptr) whole = std::make_shared<const std::string>(wire::encode(*last_));
  step.messages.push_back(to_robot(robot, bus::MessageKind::proxy_graph, whole));
}

/// Deltas grow as the map leaves the base behind. The mean of what is sent is smallest when the full graph is sent
/// again as soon as a delta is larger than that mean.
bus::Envelope Broadcast::own_graph(RobotId robot, ProxyGraph own) {
  const ProxyGraphMessage part{last_->header, std::move(own)};
  Base& base = bases_[robot];
  if (base.messages > 0) {
    auto delta = std::make_shared<const std::string>(wire::encode_delta(part, base.graph));
    if (base.messages * delta->size() <= base.bytes) {
      ++base.messages;
      base.bytes += delta->size();
      return to_robot(robot, bus::MessageKind::proxy_graph_delta, std::move(delta));
    }
  }
  auto full = std::make_shared<const std::string>(wire::encode(part));
  base = {wire::decode_proxy_graph(*full).value().graph, 1, full->size()};
  return to_robot(robot, bus::MessageKind::proxy_graph, std::move(full));
}

}  // namespace tutti::node
