// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/replayed_robot.hpp"

#include "tutti/lab/update_json.hpp"

namespace tutti::lab {

std::vector<program::Json> ReplayedRobot::take_notes() {
  std::vector<program::Json> notes;
  for (const auto& updates = actor_->updates(); scored_ < updates.size(); ++scored_)
    notes.push_back(to_json(updates[scored_]));
  const mission::PolicyTiming& timing = actor_->own_timing();
  const auto at = [this](const std::vector<double>& ms) { return timed_ < ms.size() ? ms[timed_] : 0.0; };
  for (; timed_ < timing.update_ms.size(); ++timed_)
    notes.push_back(
        program::update_timed(timing.update_ms[timed_], at(timing.comparison_ms), at(timing.optimisation_ms)));
  return notes;
}

}  // namespace tutti::lab
