// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/robot_actor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/evaluation/agreement.hpp"
#include "tutti/mission/load_meter.hpp"

namespace tutti::mission {
namespace {

constexpr const char* kBudgetPolicy = "spectral";

}  // namespace

RobotActor::RobotActor(const MissionRecording& recording, const robot::AgentConfig& config,
                       const std::vector<std::string>& policies, const evaluation::AssociationConfig& association,
                       Rng rng)
    : recording_(recording), association_(association) {
  std::vector<std::string> ordered = policies;
  std::stable_partition(ordered.begin(), ordered.end(), [](const std::string& p) { return p == kBudgetPolicy; });
  for (const std::string& policy : ordered) {
    robot::AgentConfig own = config;
    own.policy.name = policy;
    own.explain = config.explain && policy == config.policy.name;  // shadows are not shown
    members_.push_back({policy,
                        robot::RobotAgent(recording.recording.robot, 0, own, rng.fork(policy)),
                        {.robot = recording.recording.name, .policy = policy}});
    if (policy == config.policy.name) default_ = members_.size() - 1;
  }
  TUTTI_CHECK(!members_.empty() && members_[default_].policy == config.policy.name, "default policy {} does not run",
              config.policy.name);
}

double RobotActor::next_time() const {
  const Trajectory& odometry = recording_.recording.odometry;
  if (next_ >= odometry.size()) return std::numeric_limits<double>::infinity();
  return recording_.start_s + (odometry[next_].stamp - odometry.front().stamp);
}

void RobotActor::replay_next() {
  const Recording& recording = recording_.recording;
  const StampedPose& sample = recording.odometry[next_];
  const Matrix6d covariance = next_ == 0 ? Matrix6d(Matrix6d::Zero()) : recording.increment_covariance[next_ - 1];
  for (std::size_t m = 0; m < members_.size(); ++m) {
    double unused_s = 0.0;
    const CpuScope cpu(m == default_ ? cpu_s_ : unused_s);
    const auto ok = members_[m].agent.add_odometry(sample.stamp, sample.pose, covariance);
    if (!ok && m == default_) note(refused_odometry_, ok.error().message);
    if (m != default_) members_[m].agent.take_outgoing();  // shadows are never heard
  }
  feed_scan(next_);
  if (++next_ == recording.odometry.size()) default_agent().finish();
}

std::vector<SubmapMessage> RobotActor::take_outgoing() {
  const CpuScope cpu(cpu_s_);
  return default_agent().take_outgoing();
}

void RobotActor::feed_scan(std::size_t sample) {
  const Recording& recording = recording_.recording;
  if (!recording.scans || !default_agent().wants_scan()) return;  // only keyframes need one
  const auto scan = recording.scans->scan(sample);
  if (!scan) return note(refused_scans_, scan.error().message);
  if (!*scan) return;
  const CpuScope cpu(cpu_s_);
  const auto ok = default_agent().add_scan(**scan);
  if (!ok) return note(refused_scans_, ok.error().message);
  ++taken_scans_;
}

void RobotActor::receive(const ProxyGraphMessage& message, double time_s) {
  std::optional<std::size_t> budget;
  const std::size_t updates = updates_.size();
  for (Member& member : members_) {
    update(member, message, member.agent.policy().needs_budget() ? budget : std::nullopt, time_s);
    if (member.policy == kBudgetPolicy) budget = member.agent.ledger().size();
  }
  if (updates_.size() > updates) score(trajectory_of(message.graph, default_agent().chain()), updates_.back());
}

void RobotActor::score(const Trajectory& map, UpdateRecord& update) const {
  Trajectory truth;
  if (recording_.score_against_reference)
    for (const auto& pair : evaluation::associate(map, recording_.recording.reference, association_))
      truth.push_back({pair.stamp, pair.reference});
  const auto rmse = [&](const Trajectory& estimate) -> std::optional<double> {
    const auto error = evaluation::agreement(estimate, truth);
    return error ? std::optional(error->rmse_m) : std::nullopt;
  };
  Trajectory odometry;
  for (const Keyframe& keyframe : members_[default_].agent.keyframes())
    odometry.push_back({keyframe.stamp, keyframe.T_odom_body});
  update.onboard_rmse_m = rmse(odometry);
  update.server_rmse_m = rmse(map);
  for (const Member& member : members_)
    update.answers.push_back({member.policy, member.agent.ledger().size(), rmse(member.agent.corrected())});
}

void RobotActor::update(Member& member, const ProxyGraphMessage& message, std::optional<std::size_t> budget,
                        double time_s) {
  const bool is_default = &member.agent == &default_agent();
  double unused_s = 0.0;
  robot::UpdateSummary summary;
  {
    const CpuScope cpu(is_default ? cpu_s_ : unused_s);
    Stopwatch whole;
    Stopwatch stage;
    summary = member.agent.receive(message, budget, [&](robot::UpdateStage ended) {
      const double ms = stage.lap_ms();
      if (ended == robot::UpdateStage::compare) member.timing.comparison_ms.push_back(ms);
      if (ended == robot::UpdateStage::optimise) member.timing.optimisation_ms.push_back(ms);
    });
    if (summary.synchronised > 0) member.timing.update_ms.push_back(whole.lap_ms());
  }
  if (!is_default || summary.synchronised == 0) return;
  if (!estimation::is_usable(summary.optimised))
    note(failed_updates_, fmt::format("the optimisation on board ended {}", to_string(summary.optimised)));
  else if (summary.taken_back)
    note(failed_updates_, "the chosen constraints led farther from the map than odometry is");
  updates_.push_back({.time_s = time_s, .revision = summary.revision, .origins = summary.explanation.origins});
  explanation_ = std::move(summary.explanation);
}

RobotOutcome RobotActor::outcome() const {
  RobotOutcome out{
      .recording = &recording_, .default_policy = members_[default_].policy, .agents = {}, .replayed = next_};
  for (const Member& member : members_) out.agents.emplace_back(member.policy, &member.agent);
  return out;
}

std::vector<PolicyTiming> RobotActor::timing() const {
  std::vector<PolicyTiming> out;
  for (const Member& member : members_) out.push_back(member.timing);
  return out;
}

void RobotActor::note(Trouble& trouble, const std::string& message) {
  if (trouble.count++ == 0) trouble.first = message;
}

std::vector<std::string> RobotActor::troubles() const {
  std::vector<std::string> out;
  const auto add = [&](const Trouble& trouble, const char* what) {
    if (trouble.count > 0)
      out.push_back(fmt::format("{}: {} {}, the first because: {}", recording_.recording.name, trouble.count, what,
                                trouble.first));
  };
  add(refused_odometry_, "odometry samples refused");
  add(refused_scans_, "keyframes without a scan");
  add(failed_updates_, "updates without a correction");
  return out;
}

Status RobotActor::check_scans() const {
  if (taken_scans_ > 0 || refused_scans_.count == 0) return {};
  return fail(ErrorCode::invalid, "robot {}: not one scan could be read: {} of {} failed, the first because: {}",
              recording_.recording.name, refused_scans_.count, refused_scans_.count, refused_scans_.first);
}

}  // namespace tutti::mission
