// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/shadows.hpp"

#include <algorithm>

namespace tutti::lab {
namespace {

constexpr const char* kBudgetPolicy = "spectral";

}  // namespace

Shadows::Shadows(const Recording& recording, const robot::AgentConfig& config, const std::vector<std::string>& policies,
                 const Rng& rng)
    : own_policy_(config.policy.name) {
  for (const std::string& policy : policies) {
    if (policy == own_policy_) continue;
    robot::AgentConfig of_shadow = mission::with_sensors(config, recording);
    of_shadow.policy.name = policy;
    of_shadow.explain = false;  // shadows are not shown
    shadows_.push_back({policy,
                        std::make_unique<robot::RobotAgent>(recording.robot, 0, of_shadow, rng.fork(policy)),
                        {.robot = recording.name, .policy = policy}});
  }
}

void Shadows::add_odometry(const StampedPose& sample, const Matrix6d& covariance) {
  for (const Shadow& shadow : shadows_)
    if (shadow.agent->add_odometry(sample.stamp, sample.pose, covariance)) shadow.agent->take_outgoing();
}

void Shadows::add_moment(Timestamp stamp) {
  for (const Shadow& shadow : shadows_) shadow.agent->add_moment(stamp);
}

void Shadows::update(Shadow& shadow, const ProxyGraphMessage& message, std::optional<std::size_t> budget) {
  mission::UpdateStopwatch stopwatch(shadow.timing);
  const auto stage_ended = [&](robot::UpdateStage stage) { stopwatch.stage_ended(stage); };
  if (!shadow.agent->policy().needs_budget()) budget.reset();
  if (shadow.agent->receive(message, budget, stage_ended).synchronised > 0) stopwatch.update_ended();
}

std::optional<std::size_t> Shadows::before(const ProxyGraphMessage& message) {
  const auto spectral = std::ranges::find(shadows_, kBudgetPolicy, &Shadow::policy);
  if (spectral == shadows_.end()) return std::nullopt;
  update(*spectral, message, std::nullopt);
  return spectral->agent->ledger().size();
}

void Shadows::after(const ProxyGraphMessage& message, const robot::RobotAgent& own) {
  std::optional<std::size_t> budget;
  if (own_policy_ == kBudgetPolicy) budget = own.ledger().size();
  for (const Shadow& shadow : shadows_)
    if (shadow.policy == kBudgetPolicy) budget = shadow.agent->ledger().size();
  for (Shadow& shadow : shadows_)
    if (shadow.policy != kBudgetPolicy) update(shadow, message, budget);
}

std::vector<std::pair<std::string, const robot::RobotAgent*>> Shadows::agents() const {
  std::vector<std::pair<std::string, const robot::RobotAgent*>> out;
  for (const Shadow& shadow : shadows_) out.emplace_back(shadow.policy, shadow.agent.get());
  return out;
}

std::vector<mission::PolicyTiming> Shadows::timing() const {
  std::vector<mission::PolicyTiming> out;
  for (const Shadow& shadow : shadows_) out.push_back(shadow.timing);
  return out;
}

std::unique_ptr<mission::Companions> make_shadows(const Recording& recording, const robot::AgentConfig& config,
                                                  const std::vector<std::string>& policies, const Rng& rng) {
  const auto is_other = [&](const std::string& policy) { return policy != config.policy.name; };
  if (std::ranges::none_of(policies, is_other)) return nullptr;
  return std::make_unique<Shadows>(recording, config, policies, rng);
}

}  // namespace tutti::lab
