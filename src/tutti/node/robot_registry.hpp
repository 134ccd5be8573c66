// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "tutti/model/status.hpp"

namespace tutti::node {

/// Who is who: which session a robot's name and number belong to, as their statuses say. A session that has lost its
/// place to another one never gets it back, whatever its number: what a robot is sent stays with the newest.
///
/// Anybody can say a status, so of a robot without submaps in the map a claim holds while it is there, is not stored,
/// gives way to a session with submaps, and is forgotten when there are too many of them.
class RobotRegistry {
 public:
  /// An owner that was seen less than this ago is there.
  static constexpr double kOwnerIsThere_s = 30.0;
  static constexpr std::size_t kMostStrangers = 1000;  ///< Robots that have said a status and have no submaps.

  struct Robot {
    bool is_claimed = false;         ///< A session owns it: that of `status`.
    NodeStatus status;               ///< The last one of the owner; of nobody's, the last one that was refused.
    std::set<std::uint64_t> former;  ///< Sessions that it belonged to before.
    std::set<std::uint64_t> rivals;  ///< Sessions that were refused while the owner was there.
    std::optional<Timestamp> last_seen;
    std::optional<Timestamp> last_update;
    std::optional<Timestamp> last_conflict;
    std::string conflict;  ///< The last one.
  };
  struct Heard {
    bool accepted = false;
    bool must_be_stored = false;  ///< row() has changed, of a robot with submaps.
    std::string why;              ///< Refused. The same for as long as nothing changes.
  };

  /// Owners that are known from before, and whose rivals too, count as seen now.
  void start(Timestamp now) { started_ = now; }
  /// It has submaps in the map. A robot that was never heard: its sessions in the map are former ones when one of
  /// another number owns it. True: row() is to be stored from now on.
  bool note_session(const ChainId& chain);
  /// It has submaps in the map.
  [[nodiscard]] bool is_mapped(RobotId robot) const { return mapped_.contains(robot); }
  /// Whoever has none: after the rows of an older program, which stored every claim.
  void forget_strangers();
  /// What a program says that calls itself this robot.
  Heard hear(RobotId robot, const NodeStatus& status, Timestamp now);

  [[nodiscard]] const std::map<RobotId, Robot>& robots() const { return robots_; }
  /// Whose the number is; nothing when no status has said so.
  [[nodiscard]] std::optional<ChainId> owner(RobotId robot) const;
  /// Where row() is kept in the table `meta` of a map: "robot/7".
  static std::string key(RobotId robot);
  static std::optional<RobotId> robot_of(std::string_view key);
  /// What is to be stored: name and sessions.
  [[nodiscard]] std::string row(RobotId robot) const;
  /// False: the bytes are none of row().
  bool restore(RobotId robot, std::string_view row);

 private:
  [[nodiscard]] bool is_there(const Robot& robot, std::uint64_t rival, Timestamp now) const;
  [[nodiscard]] bool is_mapped(RobotId robot, std::uint64_t session) const;
  /// For one more.
  void make_room();
  /// Why it is refused; empty: it is not.
  [[nodiscard]] std::string objection(RobotId id, const NodeStatus& status, Timestamp now) const;
  void take_over(RobotId id, Robot& robot, const NodeStatus& status) const;

  std::map<RobotId, Robot> robots_;
  std::map<RobotId, std::set<std::uint64_t>> mapped_;
  Timestamp started_ = kFirstTimestamp;
};

}  // namespace tutti::node
