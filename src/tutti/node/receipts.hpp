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

/// What the server has told, or is to tell, every robot of its submaps: the mission's robots, and others, who are none
/// of it, or not yet. Bounded, whatever anybody sends.
class Receipts {
 public:
  static constexpr double kStrangerIsGone_s = 60.0;  ///< A robot without submaps, after its last word.

  Receipts() = default;
  /// Of the mission's robots, as they were stored.
  explicit Receipts(std::map<RobotId, Receipt> members) : members_(std::move(members)) {}

  [[nodiscard]] const std::map<RobotId, Receipt>& members() const { return members_; }
  /// Made where there is none yet.
  Receipt& of_member(RobotId robot);
  /// That of any robot, made where there is none yet. Null: too many strangers have one.
  Receipt* of_anybody(RobotId robot, bool is_member, Timestamp now);
  [[nodiscard]] const Receipt* find(RobotId robot) const;
  /// It is one of the mission's from now on; what it was told as a stranger stays.
  void admit(RobotId robot);
  /// It is none, after all.
  void dismiss(RobotId robot, Timestamp now);

  /// Whether the last receipt of a robot that has unconfirmed submaps is to be sent again: it may have been lost, with
  /// a bus that was killed, and the submap does not come a second time, because the bus takes an id once a day.
  bool waits_too_long(RobotId robot, const NodeStatus& status, Timestamp now);

 private:
  struct Stranger {
    Receipt receipt;
    Timestamp heard;
  };
  std::map<RobotId, Receipt> members_;
  std::map<RobotId, Stranger> strangers_;
  std::map<RobotId, Timestamp> waits_since_;  // robots with a backlog: since then without a receipt that was due
};

/// Notes that a submap came in a version that is not read. Not stored: it is for the robot to keep it, which has the
/// right one where this is garbage. Bounded as refusals are.
void note_unread(SubmapId id, Receipt& receipt);
/// It has come in a version that is read.
void forget_unread(SubmapId id, Receipt& receipt);
/// Notes that this content was refused; only the last ones are kept, so that nobody's garbage fills the receipt, or
/// keeps out the submap that a robot will send under this id. False: it was noted before, or is stored.
bool note_refused(SubmapId id, const std::string& bytes, const std::string& why, Receipt& receipt);
/// The row of the map's store that keeps what does not follow from the map.
storage::Write refusals_row(const Receipt& receipt);

}  // namespace tutti::node
