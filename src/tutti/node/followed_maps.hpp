// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <optional>

#include "tutti/consistency/change_of_mind.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/server/beliefs.hpp"

namespace tutti::node {

/// A map differs from the one that a robot follows by more than three of the followed map's standard deviations.
struct ChangeOfMind {
  RobotId robot;
  consistency::MapChange change;  ///< From the map that is followed to the new one.
  server::ChangeReason reason;    ///< Why these two maps differ.
};

/// The map that each robot follows, which is the last one that it was sent, and whether it is sent a new one.
///
/// A new map is sent at once if it concerns the robot: closures of its trajectory were found, taken up or dropped,
/// odometry of it failed or is believed again, or it lies elsewhere by more than one standard deviation (kNoticed). All
/// others have nothing to correct and would cost the radio as much: such a map is sent `unchanged_every_s` after the
/// last one.
///
/// None of this is stored, so after a restart of the server the first map is sent.
class FollowedMaps {
 public:
  static constexpr double kNoticed = 1.0 / 3.0;  ///< In consistency::MapChange::significance.

  /// `unchanged_every_s`: ServerConfig's.
  explicit FollowedMaps(double unchanged_every_s) : unchanged_every_s_(unchanged_every_s) {}

  struct Map {
    ProxyGraph own;  ///< The robot's part of the map (consistency::own_part).
    std::shared_ptr<const server::Beliefs> beliefs;
  };
  struct Decision {
    bool send = true;
    std::optional<ChangeOfMind> changed;
  };
  /// Decides about a new map; with `at_once` it is sent whatever it says.
  Decision take(RobotId robot, Map map, bool at_once, Timestamp now);
  /// To be called at next_review(), without news. True: the robot is to be sent the last map now.
  bool follow(RobotId robot, Timestamp now);
  /// When a robot is to be sent the last map if no other one is made before.
  [[nodiscard]] std::optional<Timestamp> next_review() const;

 private:
  struct Robot {
    Map followed;
    Timestamp sent;
    std::optional<Map> held;  // the last map, if it was not sent
  };
  double unchanged_every_s_;
  std::map<RobotId, Robot> robots_;
};

}  // namespace tutti::node
