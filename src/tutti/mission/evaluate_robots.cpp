// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "tutti/evaluation/agreement.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/evaluation/discontinuity.hpp"
#include "tutti/evaluation/keyframe_trajectory.hpp"
#include "tutti/evaluation/rpe.hpp"
#include "tutti/mission/evaluate.hpp"
#include "tutti/server/map_components.hpp"

namespace tutti::mission {
namespace {

/// One robot, and what its estimates are scored against.
struct Scoring {
  const MissionRecording& robot;
  const evaluation::AssociationConfig& association;
  evaluation::KeyframeTrajectory trajectory;
};

/// The share of the robot's whole distance that some of its keyframes stand for; of a robot that never moved, all.
template <class Poses>
double share_of(const evaluation::KeyframeTrajectory& trajectory, const Poses& poses) {
  return trajectory.whole_m() > 0.0 ? trajectory.part_m(poses) / trajectory.whole_m() : 1.0;
}

Accuracy accuracy_of(const Trajectory& estimate, const Scoring& scoring) {
  Accuracy out;
  if (!scoring.robot.score_against_reference) return out;
  const auto pairs = evaluation::associate(estimate, scoring.robot.recording.reference, scoring.association);
  if (const auto ate = evaluation::ate(pairs)) {
    out.rmse_m = ate->rmse_m;
    out.max_error_m = ate->max_m;
    out.scored_share = share_of(scoring.trajectory, pairs);
  }
  if (const auto rpe = evaluation::rpe_over_time(pairs, kRpeInterval_s)) {
    out.rpe_m = rpe->rmse_m;
    out.rpe_deg = rpe->rmse_deg;
  }
  if (const auto rpe = evaluation::rpe_over_distance(pairs, kRpeDistance_m)) {
    out.rpe_10m_m = rpe->rmse_m;
    out.rpe_10m_deg = rpe->rmse_deg;
  }
  return out;
}

/// Only of the robot's component: a chain with a gap may lie in several, and their frames are unrelated. How many
/// keyframes are left out.
struct ServerEstimate {
  std::uint32_t component = 0;
  Trajectory trajectory;
  std::size_t left_out = 0;
};
ServerEstimate read_server_estimate(const server::MapEstimate& map, const server::MapComponents& components,
                                    RobotId robot) {
  ServerEstimate out;
  const auto component = components.of_robot.find(robot);
  if (component == components.of_robot.end()) return out;
  out.component = component->second;
  for (const MapNode& node : map.nodes) {
    if (node.id.chain.robot != robot) continue;
    if (node.component == out.component)
      out.trajectory.push_back({node.stamp, node.T_world_body});
    else
      ++out.left_out;
  }
  return out;
}

PolicyRecord policy_record(const std::string& name, const robot::RobotAgent& agent, const Scoring& scoring,
                           const Trajectory& raw, const Trajectory& server) {
  PolicyRecord out{.name = name, .corrected = agent.corrected()};
  out.accuracy = accuracy_of(out.corrected, scoring);
  if (const auto agreement = evaluation::agreement(out.corrected, server)) out.agreement_rmse_m = agreement->rmse_m;
  out.discontinuity = evaluation::discontinuity(raw, out.corrected);
  out.constraints_added = agent.ledger().size();
  for (const consistency::Constraint& c : agent.ledger().constraints())
    out.constraints.push_back({c.from_stamp, c.to_stamp, c.kind});
  return out;
}

/// Time and where odometry went wrong, as far as the robot came.
void read_run(const RobotOutcome& robot, RobotRecord& out) {
  const Recording& recording = robot.recording->recording;
  const auto replayed = robot.way();
  out.start_s = robot.recording->start_s;
  if (replayed.empty()) return;
  out.duration_s = replayed.back().stamp - replayed.front().stamp;
  for (const DriftOrigin& origin : recording.drift_origins)
    if (origin.from <= replayed.back().stamp) out.drift_origins.push_back(origin);
}

}  // namespace

void score_update(const RobotOutcome& robot, const Trajectory& map, const evaluation::AssociationConfig& association,
                  UpdateRecord& update) {
  Trajectory truth, odometry;
  if (robot.recording->score_against_reference)
    for (const auto& pair : evaluation::associate(map, robot.recording->recording.reference, association))
      truth.push_back({pair.stamp, pair.reference});
  const auto rmse = [&](const Trajectory& estimate) -> std::optional<double> {
    const auto error = evaluation::agreement(estimate, truth);
    return error ? std::optional(error->rmse_m) : std::nullopt;
  };
  for (const Keyframe& keyframe : robot.agents.front().second->keyframes())
    odometry.push_back({keyframe.stamp, keyframe.T_odom_body});
  update.onboard_rmse_m = rmse(odometry);
  update.server_rmse_m = rmse(map);
  for (const auto& [policy, agent] : robot.agents)
    update.answers.push_back({policy, agent->ledger().size(), rmse(agent->corrected())});
}

void evaluate_robots(const std::vector<RobotOutcome>& robots, const server::MapEstimate& map,
                     const server::MapEstimate* perfect, const evaluation::AssociationConfig& association,
                     MissionRecord& record) {
  const server::MapComponents components = server::choose_components(map);
  for (std::size_t i = 0; i < robots.size(); ++i) {
    const RobotOutcome& robot = robots[i];
    const MissionRecording& recording = *robot.recording;
    RobotRecord& out = record.robots[i];
    const auto agent = std::find_if(robot.agents.begin(), robot.agents.end(),
                                    [&](const auto& entry) { return entry.first == robot.default_policy; });
    out.id = recording.recording.robot;
    out.name = recording.recording.name;
    read_run(robot, out);
    out.odometry_factors = agent->second->odometry_factors();
    out.keyframes = agent->second->keyframes().size();
    for (const Keyframe& k : agent->second->keyframes()) out.odometry.push_back({k.stamp, k.T_odom_body});
    const Scoring scoring{recording, association, evaluation::KeyframeTrajectory(robot.way(), out.odometry)};
    out.distance_m = scoring.trajectory.whole_m();
    auto [component, server_estimate, left_out] = read_server_estimate(map, components, out.id);
    out.component = component;
    out.server_estimate = std::move(server_estimate);
    if (left_out > 0)
      record.notes.push_back(fmt::format(
          "{}: the server holds components of its trajectory that no closure merges; {} of {} keyframes are not in the "
          "largest and left out of its figures",
          out.name, left_out, left_out + out.server_estimate.size()));
    if (!out.server_estimate.empty()) out.mapped_share = share_of(scoring.trajectory, out.server_estimate);
    if (const auto factor = map.rotation_factors.find(out.id); factor != map.rotation_factors.end())
      out.rotation_factor = factor->second;
    if (recording.score_against_reference) out.reference = recording.recording.reference;
    out.onboard = accuracy_of(out.odometry, scoring);
    out.server = accuracy_of(out.server_estimate, scoring);
    if (perfect != nullptr)
      out.perfect =
          accuracy_of(read_server_estimate(*perfect, server::choose_components(*perfect), out.id).trajectory, scoring);
    for (const auto& [name, policy_agent] : robot.agents)
      out.policies.push_back(policy_record(name, *policy_agent, scoring, out.odometry, out.server_estimate));
    for (const robot::Whereabouts& other : agent->second->whereabouts())
      out.whereabouts.push_back({other.robot, other.stamp, other.T_map_body});
  }
}

}  // namespace tutti::mission
