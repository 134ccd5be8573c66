// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/record.hpp"

namespace tutti::mission {

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

}  // namespace tutti::mission
