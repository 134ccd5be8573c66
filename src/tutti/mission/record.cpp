// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/record.hpp"

#include <algorithm>

namespace tutti::mission {

std::vector<consistency::Alert> alerts_of(std::span<const UpdateRecord> updates) {
  std::vector<consistency::Suspicion> suspicions;
  for (const UpdateRecord& update : updates) suspicions.push_back({update.time_s, update.revision, update.origins});
  return consistency::follow_alerts(suspicions);
}

bool is_partial(std::optional<double> scored_share) { return scored_share && *scored_share < kPartialBelow; }

bool is_tied(const MissionRecord& record, RobotId robot) {
  return std::ranges::any_of(record.server.closures, [robot](const ClosureRecord& closure) {
    return closure.from.chain.robot == robot || closure.to.chain.robot == robot;
  });
}

const PolicyRecord* find_policy(const RobotRecord& robot, const std::string& name) {
  for (const auto& policy : robot.policies)
    if (policy.name == name) return &policy;
  return nullptr;
}

const PolicyTiming* find_timing(const MissionRecord& record, const std::string& robot, const std::string& policy) {
  for (const auto& timing : record.timing.policies)
    if (timing.robot == robot && timing.policy == policy) return &timing;
  return nullptr;
}

bool compares_policies(const MissionRecord& record) {
  return std::ranges::any_of(record.robots, [](const RobotRecord& robot) { return robot.policies.size() > 1; });
}

}  // namespace tutti::mission
