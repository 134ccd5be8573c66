// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "tutti/consistency/change_of_mind.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/server/beliefs.hpp"

namespace tutti::node {

/// What becomes of a map that has changed its mind about a robot.
enum class ChangeOutcome {
  waits,   ///< The robot is not sent it before it has stood for another update.
  stands,  ///< It has: the robot is sent it.
  gone     ///< The next map is nearer to what the robot follows: nothing has come of it.
};
const char* to_string(ChangeOutcome outcome);

/// The map differs from the one that the robot follows by more than three of its own standard deviations.
struct ChangeOfMind {
  RobotId robot;
  ChangeOutcome outcome = ChangeOutcome::waits;
  consistency::MapChange change;  ///< From what is followed to the map that waits.
  server::ChangeReason reason;    ///< The same.
};

/// Decides which maps robots are sent, so that none follows a map that changes its mind and changes it back. What a
/// robot follows is the last map that it was sent. A map that differs from it by no more than it allowed for is sent at
/// once. Another one waits, and the next is sent if it lies nearer to that than to what is followed: the change stands.
/// The watch lives as long as the server's start: after another one the first map is sent as it is.
class ChangeWatch {
 public:
  struct Decision {
    bool send = true;
    std::vector<ChangeOfMind> told;
  };
  /// A new map. `own`: the robot's part of it (consistency::own_part). `wait`: false sends it whatever it says.
  Decision take(RobotId robot, const ProxyGraph& own, std::shared_ptr<const server::Beliefs> beliefs, bool wait);
  /// An update without news: what waits has stood. Nothing when nothing waits for this robot.
  std::optional<ChangeOfMind> follow(RobotId robot);
  [[nodiscard]] bool anything_waits() const;

 private:
  struct Map {
    ProxyGraph own;
    std::shared_ptr<const server::Beliefs> beliefs;
  };
  struct Waiting {
    Map map;
    consistency::MapChange change;
    server::ChangeReason reason;
  };
  struct Robot {
    Map followed;
    std::optional<Waiting> waiting;
  };
  std::map<RobotId, Robot> robots_;
};

}  // namespace tutti::node
