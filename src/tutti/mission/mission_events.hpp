// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tutti/mission/record.hpp"
#include "tutti/node/event.hpp"

namespace tutti::mission {

/// The course of a mission for its record, collected from the events of all nodes in order. Each robot's outcome is
/// collected by its RobotActor.
class MissionEvents {
 public:
  void take(const node::Event& event);
  void take(ChangeOfMindRecord change) { changes_of_mind_.push_back(std::move(change)); }
  /// Sets how many accepted closures of the latest map update are wrong.
  void set_wrong(std::size_t wrong) { updates_.back().wrong = wrong; }

  [[nodiscard]] const std::vector<MapUpdateRecord>& updates() const { return updates_; }
  [[nodiscard]] const std::vector<ChangeOfMindRecord>& changes_of_mind() const { return changes_of_mind_; }
  /// Adds one note on how many messages were refused, with the first reason; none if none was.
  void note_refusals(MissionRecord& record) const;

 private:
  std::vector<MapUpdateRecord> updates_;
  std::vector<ChangeOfMindRecord> changes_of_mind_;
  std::vector<std::string> refusals_;
  std::set<SubmapPair> failed_;  // pairs that could not be verified and are tried repeatedly
};

}  // namespace tutti::mission
