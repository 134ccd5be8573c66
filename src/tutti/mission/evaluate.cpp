// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/evaluate.hpp"

#include <algorithm>
#include <map>

#include "tutti/evaluation/agreement.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/evaluation/rpe.hpp"
#include "tutti/evaluation/transform_error.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::mission {
namespace {

Accuracy accuracy_of(const Trajectory& estimate, const MissionRecording& robot,
                     const evaluation::AssociationConfig& association) {
  Accuracy out;
  if (!robot.score_against_reference) return out;
  const auto pairs = evaluation::associate(estimate, robot.recording.reference, association);
  if (const auto ate = evaluation::ate(pairs)) {
    out.rmse_m = ate->rmse_m;
    out.max_error_m = ate->max_m;
  }
  if (const auto rpe = evaluation::rpe_over_time(pairs, kRpeInterval_s)) out.rpe_m = rpe->rmse_m;
  return out;
}

Trajectory server_estimate(RobotId robot, const server::MapEstimate& map) {
  Trajectory out;
  for (const server::MapNode& node : map.nodes)
    if (node.id.robot == robot) out.push_back({node.stamp, node.T_world_body});
  return out;
}

PolicyRecord policy_record(const std::string& name, const robot::RobotAgent& agent, const MissionRecording& robot,
                           const Trajectory& server, const evaluation::AssociationConfig& association) {
  PolicyRecord out{.name = name, .corrected = agent.corrected()};
  out.accuracy = accuracy_of(out.corrected, robot, association);
  if (const auto agreement = evaluation::agreement(out.corrected, server)) out.agreement_rmse_m = agreement->rmse_m;
  out.constraints_added = agent.ledger().size();
  for (const consistency::Constraint& c : agent.ledger().constraints())
    out.constraints.push_back({c.from_stamp, c.to_stamp, c.kind});
  return out;
}

double path_length(const Trajectory& trajectory) {
  double length = 0.0;
  for (std::size_t i = 1; i < trajectory.size(); ++i)
    length += (trajectory[i].pose.translation - trajectory[i - 1].pose.translation).norm();
  return length;
}

/// The component with most nodes.
std::uint32_t largest_component(const server::MapEstimate& map) {
  std::map<std::uint32_t, std::size_t> size;
  for (const server::MapNode& node : map.nodes) ++size[node.component];
  const auto largest =
      std::max_element(size.begin(), size.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return largest == size.end() ? 0 : largest->first;
}

Accuracy joint_accuracy(const std::vector<RobotOutcome>& robots, const server::MapEstimate& map,
                        const evaluation::AssociationConfig& association) {
  const std::uint32_t component = largest_component(map);
  std::vector<evaluation::PosePair> all;
  for (const RobotOutcome& robot : robots) {
    if (!robot.recording->score_against_reference) continue;
    Trajectory estimate;
    for (const server::MapNode& node : map.nodes)
      if (node.id.robot == robot.recording->recording.robot && node.component == component)
        estimate.push_back({node.stamp, node.T_world_body});
    const auto pairs = evaluation::associate(estimate, robot.recording->recording.reference, association);
    all.insert(all.end(), pairs.begin(), pairs.end());
  }
  Accuracy out;
  if (const auto ate = evaluation::ate(all)) {
    out.rmse_m = ate->rmse_m;
    out.max_error_m = ate->max_m;
  }
  return out;
}

/// "overlap 0.16, at least 0.3 needed" -> "overlap": what is counted is the kind of reason.
std::string without_values(const std::string& reason) {
  std::string kind = reason.substr(0, reason.find_first_of("0123456789:"));
  while (!kind.empty() && kind.back() == ' ') kind.pop_back();
  return kind;
}

void judge_closures(const server::MapServer& server, MissionRecord& record) {
  std::map<std::string, RejectionRecord> refused;
  const auto count = [&](const std::string& reason, RobotId a, RobotId b) {
    RejectionRecord& entry = refused[reason];
    entry.reason = reason;
    ++(a == b ? entry.intra : entry.inter);
  };
  for (const server::JudgedClosure& judged : server.map().closures) {
    const auto& [from, to, measurement] = judged.closure;
    if (judged.accepted)
      record.server.closures.push_back({from, to});
    else
      count("inconsistent with the others", from.robot, to.robot);
  }
  for (const auto& [pair, verdict] : server.state().verdicts)
    if (verdict.closures.empty()) count(without_values(verdict.reason), pair.first.robot, pair.second.robot);
  for (auto& [reason, entry] : refused) record.server.rejections.push_back(std::move(entry));
}

/// How far accepted closures are from the reference, where there is one.
void check_closures(const std::vector<RobotOutcome>& robots, const server::MapServer& server,
                    const evaluation::AssociationConfig& association, MissionRecord& record) {
  std::map<KeyframeId, Pose3> truth;
  for (const RobotOutcome& robot : robots) {
    const RobotId id = robot.recording->recording.robot;
    std::map<Timestamp, KeyframeId> by_stamp;
    Trajectory estimate;
    for (const server::MapNode& node : server.map().nodes)
      if (node.id.robot == id) {
        by_stamp[node.stamp] = node.id;
        estimate.push_back({node.stamp, node.T_world_body});
      }
    for (const auto& pair : evaluation::associate(estimate, robot.recording->recording.reference, association))
      truth[by_stamp.at(pair.stamp)] = pair.reference;
  }
  for (const server::JudgedClosure& judged : server.map().closures) {
    if (!judged.accepted) continue;
    const auto from = truth.find(judged.closure.from);
    const auto to = truth.find(judged.closure.to);
    if (from == truth.end() || to == truth.end()) continue;
    const Vector6d error = local(from->second.inverse() * to->second, judged.closure.measurement.T_a_b);
    auto& check = record.server.closure_check;
    if (!check) check.emplace();
    ++check->checked;
    if (error.head<3>().norm() > 0.5 || error.tail<3>().norm() > 2.0 * kRadPerDeg) ++check->wrong;
    check->max_error_m = std::max(check->max_error_m, error.head<3>().norm());
    check->max_error_deg = std::max(check->max_error_deg, error.tail<3>().norm() / kRadPerDeg);
  }
}

void collect_map(const std::vector<RobotOutcome>& robots, const server::MapServer& server, MissionRecord& record) {
  const server::MapEstimate& map = server.map();
  record.server.graph = map.graph;
  std::map<KeyframeId, Pose3> pose;
  for (const server::MapNode& node : map.nodes) {
    record.server.nodes.push_back({node.id, node.stamp});
    pose[node.id] = node.T_world_body;
  }
  for (const RobotOutcome& robot : robots) {
    CloudRecord cloud{.robot = robot.recording->recording.robot};
    for (const auto& [id, submap] : server.state().submaps) {
      if (id.robot != cloud.robot || !server.state().cloud_sizes.contains(id)) continue;
      // The cloud hangs on the keyframe in its middle, as its closures do.
      const Keyframe& first = submap->keyframes.front();
      const Keyframe& middle = submap->keyframes[submap->keyframes.size() / 2];
      const auto found = pose.find({id.robot, middle.index});
      if (found == pose.end()) continue;
      const auto seen = server.clouds().get(id);
      if (!seen) {
        record.notes.push_back("Missing in the map: " + seen.error().message + ".");
        continue;
      }
      const Eigen::Isometry3f T_world_submap(
          (found->second * middle.T_odom_body.inverse() * first.T_odom_body).matrix().cast<float>());
      for (const Eigen::Vector3f& p : (*seen)->points) cloud.cloud.points.push_back(T_world_submap * p);
    }
    if (!cloud.cloud.points.empty()) record.server.clouds.push_back(std::move(cloud));
  }
}

/// Where every robot's odometry frame lies in that of the first robot of its component.
void relate_robots(const std::vector<RobotOutcome>& robots, const server::MapEstimate& map, MissionRecord& record) {
  std::map<RobotId, std::uint32_t> component;
  for (const server::MapNode& node : map.nodes) component.try_emplace(node.id.robot, node.component);
  for (std::size_t i = 0; i < robots.size(); ++i)
    for (std::size_t j = i + 1; j < robots.size(); ++j) {
      const MissionRecording& a = *robots[i].recording;
      const MissionRecording& b = *robots[j].recording;
      const auto of_a = component.find(a.recording.robot);
      const auto of_b = component.find(b.recording.robot);
      if (of_a == component.end() || of_b == component.end() || of_a->second != of_b->second) continue;
      const auto T_a_world = odom_from_world(a.recording.robot, map);
      const auto T_b_world = odom_from_world(b.recording.robot, map);
      if (!T_a_world || !T_b_world) continue;
      TransformRecord transform{a.recording.name, b.recording.name, *T_a_world * T_b_world->inverse(), {}, {}};
      const auto centre = evaluation::centroid(b.recording.odometry);
      if (a.T_common_odom && b.T_common_odom && centre) {
        const auto error =
            evaluation::transform_error(transform.T_from_to, a.T_common_odom->inverse() * *b.T_common_odom, *centre);
        transform.error_m = error.translation_m;
        transform.error_deg = error.rotation_deg;
      }
      record.transforms.push_back(std::move(transform));
    }
}

}  // namespace

std::optional<Pose3> odom_from_world(RobotId robot, const server::MapEstimate& map) {
  std::vector<Eigen::Vector3d> odom;
  std::vector<Eigen::Vector3d> world;
  std::optional<std::uint32_t> component;
  for (const server::MapNode& node : map.nodes) {
    if (node.id.robot != robot) continue;
    if (!component) component = node.component;
    if (node.component != *component) continue;
    odom.push_back(node.T_odom_body.translation);
    world.push_back(node.T_world_body.translation);
  }
  if (odom.empty()) return std::nullopt;
  return align_points(odom, world);
}

void evaluate_robots(const std::vector<RobotOutcome>& robots, const server::MapEstimate& map,
                     const evaluation::AssociationConfig& association, MissionRecord& record) {
  for (std::size_t i = 0; i < robots.size(); ++i) {
    const RobotOutcome& robot = robots[i];
    const MissionRecording& recording = *robot.recording;
    RobotRecord& out = record.robots[i];
    const auto agent = std::find_if(robot.agents.begin(), robot.agents.end(),
                                    [&](const auto& entry) { return entry.first == robot.default_policy; });
    out.id = recording.recording.robot;
    out.name = recording.recording.name;
    out.distance_m = path_length(recording.recording.odometry);
    out.duration_s = recording.recording.odometry.back().stamp - recording.recording.odometry.front().stamp;
    out.odometry_factors = agent->second->odometry_factors();
    out.keyframes = agent->second->keyframes().size();
    for (const Keyframe& k : agent->second->keyframes()) out.odometry.push_back({k.stamp, k.T_odom_body});
    out.server_estimate = server_estimate(out.id, map);
    if (recording.score_against_reference) out.reference = recording.recording.reference;
    out.onboard = accuracy_of(out.odometry, recording, association);
    out.server = accuracy_of(out.server_estimate, recording, association);
    for (const auto& [name, policy_agent] : robot.agents)
      out.policies.push_back(policy_record(name, *policy_agent, recording, out.server_estimate, association));
    for (const robot::Whereabouts& other : agent->second->whereabouts())
      out.whereabouts.push_back({other.robot, other.stamp, other.T_map_body});
  }
}

void evaluate_server(const std::vector<RobotOutcome>& robots, const server::MapServer& server,
                     const evaluation::AssociationConfig& association, MissionRecord& record) {
  record.server.components = server.map().components;
  record.server.joint = joint_accuracy(robots, server.map(), association);
  judge_closures(server, record);
  check_closures(robots, server, association, record);
  collect_map(robots, server, record);
  relate_robots(robots, server.map(), record);
}

}  // namespace tutti::mission
