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

void Broadcast::send(ProxyGraphMessage map, std::shared_ptr<const server::Beliefs> beliefs,
                     const std::set<RobotId>& robots, bool wait, Timestamp now, Step& step) {
  last_ = std::move(map);
  std::set<RobotId> heard;
  for (const RobotId robot : robots) {
    ChangeWatch::Decision decision = watch_.take(robot, consistency::own_part(last_.graph, robot), beliefs, wait);
    if (decision.send) heard.insert(robot);
    for (ChangeOfMind& told : decision.told) step.tell(now, std::move(told));
  }
  send_last(heard, step);
}

void Broadcast::send_waiting(const std::set<RobotId>& robots, Timestamp now, Step& step) {
  std::set<RobotId> heard;
  for (const RobotId robot : robots)
    if (auto told = watch_.follow(robot)) {
      heard.insert(robot);
      step.tell(now, std::move(*told));
    }
  send_last(heard, step);
}

void Broadcast::send_last(const std::set<RobotId>& robots, Step& step) {
  if (robots.empty()) return;
  if (!to_all_) {
    for (const RobotId robot : robots) step.messages.push_back(own_graph(robot));
    return;
  }
  const auto whole = std::make_shared<const std::string>(wire::encode(last_));
  for (const RobotId robot : robots) step.messages.push_back(to_robot(robot, bus::MessageKind::proxy_graph, whole));
}

/// Deltas grow as the map leaves the base behind. The mean of what is sent is smallest when the full graph is sent
/// again as soon as a delta is larger than that mean.
bus::Envelope Broadcast::own_graph(RobotId robot) {
  const ProxyGraphMessage part{last_.header, consistency::own_part(last_.graph, robot)};
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
