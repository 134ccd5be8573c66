// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>

#include "tutti/evaluation/ate.hpp"
#include "tutti/evaluation/transform_error.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/mission/evaluate.hpp"

namespace tutti::mission {
namespace {

/// The component with most nodes.
std::uint32_t largest_component(const server::MapEstimate& map) {
  std::map<std::uint32_t, std::size_t> size;
  for (const server::MapNode& node : map.nodes) ++size[node.component];
  const auto largest =
      std::max_element(size.begin(), size.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return largest == size.end() ? 0 : largest->first;
}

/// All robots of the largest component together, one alignment.
void measure_joint_map(const std::vector<RobotOutcome>& robots, const server::MapEstimate& map,
                       const evaluation::AssociationConfig& association, ServerRecord& out) {
  out.components = map.components;
  out.largest_component = largest_component(map);
  std::vector<evaluation::PosePair> all;
  for (const RobotOutcome& robot : robots) {
    if (!robot.recording->score_against_reference) continue;
    Trajectory estimate;
    for (const server::MapNode& node : map.nodes)
      if (node.id.robot == robot.recording->recording.robot && node.component == out.largest_component)
        estimate.push_back({node.stamp, node.T_world_body});
    const auto pairs = evaluation::associate(estimate, robot.recording->recording.reference, association);
    all.insert(all.end(), pairs.begin(), pairs.end());
  }
  if (const auto ate = evaluation::ate(all)) {
    out.joint.rmse_m = ate->rmse_m;
    out.joint.max_error_m = ate->max_m;
    out.T_reference_world = ate->T_reference_estimate;
  }
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

/// Stretches of odometry that the server convicted, with the times the report wants.
void name_failures(const server::MapEstimate& map, ServerRecord& out) {
  std::map<KeyframeId, Timestamp> stamp;
  for (const server::MapNode& node : map.nodes) stamp[node.id] = node.stamp;
  for (const server::FailedOdometry& failed : map.failed_odometry)
    out.failed_odometry.push_back({.robot = failed.robot,
                                   .from = stamp.at({failed.robot, failed.from}),
                                   .until = stamp.at({failed.robot, failed.to}),
                                   .error_m = failed.jump_m,
                                   .error_rad = failed.jump_rad});
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

/// T_odom-of-robot <- world, from the server's and the raw poses of the robot's keyframes: the rigid motion that fits
/// the whole trajectory best.
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
      const auto& way = b.recording.odometry;
      const auto centre = evaluation::centroid({way.begin(), way.begin() + static_cast<long>(robots[j].replayed)});
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

void evaluate_server(const std::vector<RobotOutcome>& robots, const server::MapServer& server,
                     const evaluation::AssociationConfig& association, MissionRecord& record) {
  measure_joint_map(robots, server.map(), association, record.server);
  judge_closures(server, record);
  name_failures(server.map(), record.server);
  check_closures(robots, server, association, record);
  record.server.graph = server.map().graph;
  for (const server::MapNode& node : server.map().nodes) record.server.nodes.push_back({node.id, node.stamp});
  relate_robots(robots, server.map(), record);
  evaluate_map(server, association, record);
}

}  // namespace tutti::mission
