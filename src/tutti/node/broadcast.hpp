// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "tutti/bus/envelope.hpp"
#include "tutti/model/messages.hpp"
#include "tutti/node/followed_maps.hpp"
#include "tutti/node/step.hpp"

namespace tutti::node {

/// A message from the server to one robot.
bus::Envelope to_robot(RobotId robot, bus::MessageKind kind, std::shared_ptr<const std::string> bytes);

/// Sends the server's maps to robots: each gets its own part (consistency::own_part) when there is something to correct
/// (FollowedMaps), encoded as differences from what it was sent before where that saves bytes.
class Broadcast {
 public:
  /// With `to_all` every robot is sent the whole map, as in the paper (ServerConfig::broadcast).
  Broadcast(bool to_all, double unchanged_every_s) : to_all_(to_all), followed_(unchanged_every_s) {}

  /// Sends a new map, in which robots have these `names`, and which rests on `beliefs`, to the robots that are to
  /// follow it (FollowedMaps::take).
  void send(ProxyGraphMessage map, const std::map<RobotId, std::string>& names,
            std::shared_ptr<const server::Beliefs> beliefs, const std::set<RobotId>& robots, bool at_once,
            Timestamp now, Step& step);
  /// When some robot is to be sent the last map if no other one is made before.
  [[nodiscard]] std::optional<Timestamp> next_review() const { return followed_.next_review(); }
  /// Sends the last map to the robots that are to be sent it now.
  void send_waiting(const std::set<RobotId>& robots, Timestamp now, Step& step);
  /// The last map; empty before the first.
  [[nodiscard]] std::shared_ptr<const ProxyGraph> last() const { return {last_, &last_->graph}; }

 private:
  /// Sends `own`, the robot's part of the last map. `whole` is the whole map, encoded when it is first needed.
  void send_last(RobotId robot, ProxyGraph own, std::shared_ptr<const std::string>& whole, Step& step);
  /// The message with a robot's part: in full, or as differences from the last one sent in full, whichever is fewer
  /// bytes in the long run.
  [[nodiscard]] bus::Envelope own_graph(RobotId robot, ProxyGraph own);

  bool to_all_;
  std::shared_ptr<const ProxyGraphMessage> last_ = std::make_shared<const ProxyGraphMessage>();
  FollowedMaps followed_;
  /// The graph that a robot was last sent in full, and how much was sent as differences from it since.
  struct Base {
    ProxyGraph graph;
    std::size_t messages = 0, bytes = 0;  // including the one sent in full
  };
  std::map<RobotId, Base> bases_;
};

}  // namespace tutti::node
