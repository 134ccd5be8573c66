// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "tutti/model/messages.hpp"
#include "tutti/model/status.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::node {

/// The server's reports to each robot about its submaps, made or still to make: the mission's robots (members), and
/// others (strangers). Memory is bounded, whatever anybody sends.
class Receipts {
 public:
  /// A stranger's receipt may be dropped this long after its last message.
  static constexpr double kStrangerIsGone_s = 60.0;

  Receipts() = default;
  /// With the members' receipts as they were stored.
  explicit Receipts(std::map<RobotId, Receipt> members) : members_(std::move(members)) {}

  [[nodiscard]] const std::map<RobotId, Receipt>& members() const { return members_; }
  /// The receipt of a member; made when there is none.
  Receipt& of_member(RobotId robot);
  /// The receipt of any robot; made when there is none. Null when there are too many strangers.
  Receipt* of_anybody(RobotId robot, bool is_member, Timestamp now);
  [[nodiscard]] const Receipt* find(RobotId robot) const;
  /// The robot becomes a member, and keeps its receipt.
  void admit(RobotId robot);
  /// The robot is a stranger after all, and keeps its receipt.
  void dismiss(RobotId robot, Timestamp now);

  /// True when the robot still has unconfirmed submaps some time after its last receipt, so that the receipt is to be
  /// sent again. It may be lost with a bus that was killed, and the robot's submap cannot come a second time to ask for
  /// it, because the bus accepts an id once a day.
  bool waits_too_long(RobotId robot, const NodeStatus& status, Timestamp now);

 private:
  struct Stranger {
    Receipt receipt;
    Timestamp heard;
  };
  std::map<RobotId, Receipt> members_;
  std::map<RobotId, Stranger> strangers_;
  std::map<RobotId, Timestamp> waits_since_;  // since when a robot with a backlog waits for a receipt
};

/// Notes that a submap came in a version that this program cannot read. The note is not stored, because the robot keeps
/// the submap; if the bytes were garbage, the robot still has the right ones. Bounded like refusals.
void note_unread(SubmapId id, Receipt& receipt);
/// The submap has come in a version that can be read.
void forget_unread(SubmapId id, Receipt& receipt);
/// Notes that this content was refused. Only the latest refusals are kept, so that garbage sent by anybody neither
/// fills the receipt nor blocks the submap that the robot will send under this id. Where another submap is stored under
/// the id, whose content this is can see that it is not its own. False when it was noted before.
bool note_refused(SubmapId id, const std::string& bytes, const std::string& why, Receipt& receipt);
/// The row of table `meta` that stores a robot's refusals, which do not follow from the map.
storage::Write refusals_row(const Receipt& receipt);

}  // namespace tutti::node
