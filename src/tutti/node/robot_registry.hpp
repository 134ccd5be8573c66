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

/// Decides which session owns a robot's name and number, by the statuses that programs send. A session that has lost
/// them to another never gets them back, whatever its number; robots' messages go to the newest owner.
///
/// A program that starts on a copied state folder has the session of another one that lives. Their starts differ
/// (NodeStatus::start), but so does the start of a robot that was killed and goes on. So a new start is believed until
/// the one before it has been heard again for kHeardAgain_s: then both live, and the newer one is refused.
///
/// Anybody can send a status. So the claim of a robot without submaps in the map counts only while the robot is heard;
/// it is not stored, yields to a session with submaps, and is dropped when there are too many.
class RobotRegistry {
 public:
  /// An owner counts as present when it was heard less than this ago.
  static constexpr double kOwnerIsThere_s = 30.0;
  static constexpr double kHeardAgain_s = 5.0;         ///< At once it may be a message that was late.
  static constexpr std::size_t kMostStrangers = 1000;  ///< Limit on robots that have sent a status and have no submaps.

  struct Robot {
    bool is_claimed = false;         ///< A session owns the robot; it is that of `status`.
    NodeStatus status;               ///< The owner's latest status; without an owner, the latest that was refused.
    std::set<std::uint64_t> former;  ///< Sessions that owned it before.
    std::set<std::uint64_t> rivals;  ///< Sessions that were refused while the owner was present.
    std::optional<Timestamp> last_seen;
    std::optional<Timestamp> last_update;
    std::optional<Timestamp> last_conflict;
    std::string conflict;                  ///< Why a session was refused last.
    std::uint64_t start_before = 0;        ///< The owner's session was of this start before; 0: of no other.
    std::optional<Timestamp> heard_again;  ///< When that was first heard since.
    std::set<std::uint64_t> copies;        ///< Starts of the owner's session that are not the first of those that live.
  };
  struct Heard {
    bool accepted = false;
    bool must_be_stored = false;  ///< The robot has submaps, and row() has changed.
    std::string why;              ///< Why the status is refused. The text stays the same while nothing changes.
  };

  /// Owners and rivals that are known from the store count as heard at `now`.
  void start(Timestamp now) { started_ = now; }
  /// Notes that the chain has submaps in the map. If no program of this robot was heard yet and another session then
  /// claims it, the robot's sessions in the map become former ones. True when row() must be stored from now on.
  bool note_session(const ChainId& chain);
  /// True if the robot has submaps in the map.
  [[nodiscard]] bool is_mapped(RobotId robot) const { return mapped_.contains(robot); }
  /// Takes the status of a program that claims to be this robot.
  Heard hear(RobotId robot, const NodeStatus& status, Timestamp now);

  [[nodiscard]] const std::map<RobotId, Robot>& robots() const { return robots_; }
  /// The chain that owns the robot's number; nothing when no status has claimed it.
  [[nodiscard]] std::optional<ChainId> owner(RobotId robot) const;
  /// Key of row() in table `meta` of a map's store: "robot/7".
  static std::string key(RobotId robot);
  static std::optional<RobotId> robot_of(std::string_view key);
  /// The robot's name and sessions, encoded for the store.
  [[nodiscard]] std::string row(RobotId robot) const;
  /// Restores what row() has encoded; false when the bytes are no such row.
  bool restore(RobotId robot, std::string_view row);

 private:
  [[nodiscard]] bool is_there(const Robot& robot, std::uint64_t rival, Timestamp now) const;
  [[nodiscard]] bool is_mapped(RobotId robot, std::uint64_t session) const;
  /// Removes a stranger when there is no room for one more.
  void make_room();
  /// Why the status is refused; empty when it is not.
  [[nodiscard]] std::string objection(RobotId id, const NodeStatus& status, Timestamp now) const;
  /// Takes the start of a status of the owner's session; false when the status is an old one's, and has nothing new.
  static bool note_start(Robot& robot, const NodeStatus& status, Timestamp now);
  void take_over(RobotId id, Robot& robot, const NodeStatus& status) const;

  std::map<RobotId, Robot> robots_;
  std::map<RobotId, std::set<std::uint64_t>> mapped_;
  Timestamp started_ = kFirstTimestamp;
};

}  // namespace tutti::node
