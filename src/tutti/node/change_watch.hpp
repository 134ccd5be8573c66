// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
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
  waits,   ///< The robot is not sent the map before it has stood: for another update, or for minutes.
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
/// other waits. The next map is sent if it is nearer to the waiting map than to the followed one: the change stands. A
/// change that rests on the closures of one pair of places must stand for kStands_s: similar places come in groups, and
/// what is right is seen again from elsewhere. The watch is not stored, so after a restart of the server the first map
/// is sent as it is.
class ChangeWatch {
 public:
  static constexpr double kAnother_s = 10.0;
  static constexpr double kStands_s = 120.0;

  struct Map {
    ProxyGraph own;  ///< The robot's part of the map (consistency::own_part).
    std::shared_ptr<const server::Beliefs> beliefs;
  };
  struct Decision {
    bool send = true;
    std::vector<ChangeOfMind> reports;
  };
  /// On how many closures of one pair of places the difference between the new map and `followed` rests; 0: on more
  /// than one group (server::change_support).
  using LoneClosures = std::function<std::size_t(const Map& followed, const ProxyGraph& own)>;

  /// Decides about a new map. `lone` is asked when the map has changed its mind; without it the map is always sent.
  Decision take(RobotId robot, Map map, const LoneClosures& lone, Timestamp now);
  /// To be called at an update without news, because the waiting map has then stood. Nothing when no map waits for this
  /// robot, or the change must stand for longer.
  std::optional<ChangeOfMind> follow(RobotId robot, Timestamp now);
  [[nodiscard]] bool anything_waits() const;

 private:
  struct Waiting {
    Timestamp since;
    Map map;
    consistency::MapChange change;
    server::ChangeReason reason;
  };
  struct Robot {
    Map followed;
    std::optional<Waiting> waiting;
  };
  static bool has_stood(const Waiting& waiting, std::size_t lone_closures, Timestamp now);

  std::map<RobotId, Robot> robots_;
};

}  // namespace tutti::node
