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

/// What becomes of a map that has changed its mind about a robot (consistency::MapChange).
enum class ChangeOutcome {
  waits,   ///< The robot is not sent the map before it has stood for another update.
  stands,  ///< The map has stood, and the robot is sent it.
  gone     ///< The next map is nearer to the one that the robot follows, so the change is dropped.
};
const char* to_string(ChangeOutcome outcome);

/// A map differs from the one that a robot follows by more than three of the followed map's standard deviations.
struct ChangeOfMind {
  RobotId robot;
  ChangeOutcome outcome = ChangeOutcome::waits;
  consistency::MapChange change;  ///< From the map that is followed to the map that waits.
  server::ChangeReason reason;    ///< Why these two maps differ.
};

/// Decides which maps robots are sent, so that no robot follows a change that the next map takes back. A robot follows
/// the last map that it was sent. A map that differs from that one by no more than it allowed for is sent at once; any
/// other waits. The next map is sent if it is nearer to the waiting map than to the followed one: the change stands.
/// The watch is not stored, so after a restart of the server the first map is sent as it is.
class ChangeWatch {
 public:
  struct Decision {
    bool send = true;
    std::vector<ChangeOfMind> told;
  };
  /// Decides about a new map. `own` is the robot's part of it (consistency::own_part), `beliefs` what the map takes for
  /// true. Without `wait` the map is always sent.
  Decision take(RobotId robot, const ProxyGraph& own, std::shared_ptr<const server::Beliefs> beliefs, bool wait);
  /// To be called at an update without news, because the waiting map has then stood. Nothing when no map waits for this
  /// robot.
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
