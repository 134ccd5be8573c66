// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/shadows.hpp"

#include <algorithm>

#include "tutti/base/check.hpp"

namespace tutti::lab {
namespace {

constexpr const char* kBudgetPolicy = "spectral";

}  // namespace

Shadows::Shadows(const Recording& recording, const robot::AgentConfig& config, const std::vector<std::string>& policies,
                 std::uint64_t seed)
    : own_policy_(config.policy.name) {
  const Rng rng = Rng(seed).fork("agent/" + recording.name);
  robot::AgentConfig of_shadow = drive::with_sensors(config, recording);
  of_shadow.explain = false;  // shadows are not shown
  for (const std::string& name : policies) {
    if (name == own_policy_) continue;
    auto policy = make_policy(name, config, rng.fork(name));
    TUTTI_CHECK(policy.has_value(), "{}", policy.error().message);
    auto* const spends = dynamic_cast<BudgetedPolicy*>(policy->get());
    shadows_.push_back({name,
                        spends,
                        std::make_unique<robot::RobotAgent>(recording.robot, 0, of_shadow, std::move(*policy)),
                        {.robot = recording.name, .policy = name}});
  }
}

void Shadows::add(const OdometrySample& sample) {
  for (const Shadow& shadow : shadows_)
    if (shadow.agent->add(sample)) shadow.agent->take_outgoing();
}

void Shadows::add_keyframe_time(Timestamp stamp) {
  for (const Shadow& shadow : shadows_) shadow.agent->add_keyframe_time(stamp);
}

void Shadows::update(Shadow& shadow, const ProxyGraphMessage& message) {
  drive::UpdateStopwatch stopwatch;
  const auto stage_ended = [&](robot::UpdateStage stage) { stopwatch.stage_ended(stage); };
  if (shadow.agent->receive(message, stage_ended).synchronised > 0) shadow.timing.add(*stopwatch.ended());
}

void Shadows::receive(const ProxyGraphMessage& message, const robot::RobotAgent& own) {
  const robot::RobotAgent* gives = own_policy_ == kBudgetPolicy ? &own : nullptr;
  for (Shadow& shadow : shadows_) {
    if (shadow.policy != kBudgetPolicy) continue;
    update(shadow, message);
    gives = shadow.agent.get();
  }
  for (Shadow& shadow : shadows_) {
    if (shadow.policy == kBudgetPolicy) continue;
    if (gives && shadow.spends) shadow.spends->set_budget(gives->ledger().size());
    update(shadow, message);
  }
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
                                                  const std::vector<std::string>& policies, std::uint64_t seed) {
  const auto is_other = [&](const std::string& policy) { return policy != config.policy.name; };
  if (std::ranges::none_of(policies, is_other)) return nullptr;
  return std::make_unique<Shadows>(recording, config, policies, seed);
}

}  // namespace tutti::lab
