// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/replayed_robot.hpp"

#include <vector>

#include "tutti/lab/update_json.hpp"

namespace tutti::lab {

std::vector<program::Json> ReplayedRobot::take_notes() {
  std::vector<program::Json> out;
  for (; noted_ < actor_->updates().size(); ++noted_) out.push_back(to_json(actor_->updates()[noted_]));
  return out;
}

program::Json ReplayedRobot::last_words() const {
  const mission::PolicyTiming timing = actor_->timing().front();
  return {{"troubles", actor_->troubles()},
          {"update_ms", timing.update_ms},
          {"comparison_ms", timing.comparison_ms},
          {"optimisation_ms", timing.optimisation_ms}};
}

}  // namespace tutti::lab
