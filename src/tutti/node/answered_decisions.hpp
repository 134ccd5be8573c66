// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/model/status.hpp"

namespace tutti::node {

/// The operators' decisions that the server answered last, as in MissionStatus::decisions.
class AnsweredDecisions {
 public:
  /// Notes the answer to a decision: `frame` is the message as it came, `why` is why the decision is not stored
  /// (empty: it is).
  void note(const std::string& frame, const std::string& why);
  /// True if this message is among these and is stored.
  [[nodiscard]] bool is_stored(const std::string& frame) const;
  [[nodiscard]] const std::vector<MissionStatus::Decision>& all() const { return decisions_; }

 private:
  std::vector<MissionStatus::Decision> decisions_;
};

}  // namespace tutti::node
