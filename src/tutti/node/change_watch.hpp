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
  waits,   ///< The robot is not sent the map before the change has stood, or has a second witness.
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

/// Decides which maps robots are sent. A robot follows the last map that it was sent.
///
/// *What is sent.* A map that differs from the followed one by no more than that allowed for is sent at once if it
/// concerns the robot: closures of its trajectory were found, taken up or dropped, odometry of it failed or is believed
/// again, or it lies elsewhere by more than one standard deviation (kNoticed). All others have nothing to correct and
/// would cost the radio as much: such a map is sent kAnyway_s after the last one.
///
/// *What waits.* Any other map has changed its mind, and waits, so that no robot follows what the next map takes back.
/// The change stands when a later map that has more about the robot (another submap of it, or closures as above) is
/// nearer to the waiting map than to the followed one, or when none such has come for kStands_s. A change that rests on
/// the closures of one pair of places and for which odometry of the robot must have failed waits for a second witness
/// instead: it stands when the loss of no one group would undo it (server::change_support), or after kWitness_s, as a
/// place may never be seen again. Similar places come in groups, and what is right is mostly seen again from elsewhere.
/// A change that rests on one place and agrees with odometry moves the robot by no more than odometry may be wrong, so
/// it does not wait for that.
///
/// The watch is not stored, so after a restart of the server the first map is sent as it is.
class ChangeWatch {
 public:
  static constexpr double kNoticed = 1.0 / 3.0;  ///< In consistency::MapChange::significance.
  static constexpr double kAnyway_s = 20.0;
  static constexpr double kStands_s = 5.0;
  static constexpr double kWitness_s = 120.0;

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
  struct Late {
    std::optional<ChangeOfMind> report;
  };
  /// To be called at next_review(), without news. Nothing: the robot is not to be sent the last map yet, or has it.
  std::optional<Late> follow(RobotId robot, Timestamp now);
  /// When a robot is to be sent the last map if no other one is made before.
  [[nodiscard]] std::optional<Timestamp> next_review() const;

 private:
  struct Waiting {
    Timestamp since;
    Map map;  // the last one that had more about the robot
    consistency::MapChange change;
    server::ChangeReason reason;
  };
  struct Robot {
    Map followed;
    Timestamp sent;
    std::optional<Map> held;  // the last map, if it was not sent
    std::optional<Waiting> waiting;
  };
  /// Decides about a map that has changed its mind; true: it is to be sent.
  static bool stands(Robot& robot, const Map& map, const consistency::MapChange& change, const LoneClosures& lone,
                     Timestamp now, RobotId id, std::vector<ChangeOfMind>& reports);
  static std::optional<Timestamp> due(const Robot& robot);

  std::map<RobotId, Robot> robots_;
};

}  // namespace tutti::node
