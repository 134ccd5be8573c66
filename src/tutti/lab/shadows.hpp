// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tutti/lab/policies.hpp"
#include "tutti/mission/robot_actor.hpp"

namespace tutti::lab {

/// Shadows: agents that hear the broadcasts of a robot and follow other policies than it, and that nobody hears. A
/// policy with a budget gets as many constraints as `spectral` has after the same broadcast.
class Shadows final : public mission::Companions {
 public:
  /// `policies` are those that run beside the robot's own, config.policy.name. An unknown one throws.
  Shadows(const Recording& recording, const robot::AgentConfig& config, const std::vector<std::string>& policies,
          std::uint64_t seed);
  void add(const OdometrySample& sample) override;
  void add_keyframe_time(Timestamp stamp) override;
  void receive(const ProxyGraphMessage& message, const robot::RobotAgent& own) override;
  [[nodiscard]] std::vector<std::pair<std::string, const robot::RobotAgent*>> agents() const override;
  [[nodiscard]] std::vector<mission::PolicyTiming> timing() const override;

 private:
  struct Shadow {
    std::string policy;
    BudgetedPolicy* spends = nullptr;  ///< The agent's policy; null when it has no budget.
    std::unique_ptr<robot::RobotAgent> agent;
    mission::PolicyTiming timing;
  };
  static void update(Shadow& shadow, const ProxyGraphMessage& message);

  std::string own_policy_;
  std::vector<Shadow> shadows_;
};

/// The shadows of one robot; null when the mission compares no policies.
std::unique_ptr<mission::Companions> make_shadows(const Recording& recording, const robot::AgentConfig& config,
                                                  const std::vector<std::string>& policies, std::uint64_t seed);

}  // namespace tutti::lab
