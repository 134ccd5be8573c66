// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "tutti/bus/envelope.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/node/change_watch.hpp"
#include "tutti/node/step.hpp"

namespace tutti::node {

bus::Envelope to_robot(RobotId robot, bus::MessageKind kind, std::shared_ptr<const std::string> bytes);

/// What robots are sent of the server's maps: each its own part, in terms of what it was sent before, once the part is
/// to be followed (ChangeWatch).
class Broadcast {
 public:
  /// `to_all`: every robot is sent all of the map, as in the paper (ServerConfig::broadcast).
  explicit Broadcast(bool to_all) : to_all_(to_all) {}

  /// A new map, with what it believes. `wait`: a change of mind waits; otherwise every robot is sent the map.
  void send(ProxyGraphMessage map, std::shared_ptr<const server::Beliefs> beliefs, const std::set<RobotId>& robots,
            bool wait, Timestamp now, Step& step);
  /// Some robot was not sent the last map.
  [[nodiscard]] bool anything_waits() const { return watch_.anything_waits(); }
  /// The last map, to the robots that wait for it: it has stood.
  void send_waiting(const std::set<RobotId>& robots, Timestamp now, Step& step);
  /// The last map; empty before.
  [[nodiscard]] const ProxyGraph& last() const { return last_.graph; }

 private:
  /// The last map, of which `own` is the robot's part. `whole`: all of it, encoded when it is first needed.
  void send_last(RobotId robot, ProxyGraph own, std::shared_ptr<const std::string>& whole, Step& step);
  /// In full, or in terms of the last one that was, whichever makes fewer bytes in the long run.
  [[nodiscard]] bus::Envelope own_graph(RobotId robot, ProxyGraph own);

  bool to_all_;
  ProxyGraphMessage last_;
  ChangeWatch watch_;
  /// What a robot was sent in full, as it knows it, and what has come in terms of it since.
  struct Base {
    ProxyGraph graph;
    std::size_t messages = 0, bytes = 0;  // the full one among them
  };
  std::map<RobotId, Base> bases_;
};

}  // namespace tutti::node
