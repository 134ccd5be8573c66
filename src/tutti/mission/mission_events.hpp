// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>
#include <string>
#include <vector>

#include "tutti/mission/record.hpp"
#include "tutti/node/event.hpp"

namespace tutti::mission {

/// What a mission's record says of its course, folded from the events of all nodes in their order. What becomes of each
/// robot its RobotActor folds.
class MissionEvents {
 public:
  void take(const node::Event& event);
  void take(const ChangeOfMindRecord& change);
  /// Of the closures of the map update taken last.
  void set_wrong(std::size_t wrong) { updates_.back().wrong = wrong; }

  [[nodiscard]] const std::vector<MapUpdateRecord>& updates() const { return updates_; }
  [[nodiscard]] const std::vector<ChangeOfMindRecord>& changes_of_mind() const { return changes_of_mind_; }
  /// One line that says how many messages were refused, and the first reason; none if none was.
  void note_refusals(MissionRecord& record) const;

 private:
  std::vector<MapUpdateRecord> updates_;
  std::vector<ChangeOfMindRecord> changes_of_mind_;
  std::vector<std::string> refusals_;
  std::set<SubmapPair> failed_;  // pairs that could not be verified: they are tried again and again
};

}  // namespace tutti::mission
