// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>

#include "tutti/evaluation/ate.hpp"
#include "tutti/evaluation/keyframe_trajectory.hpp"
#include "tutti/evaluation/transform_error.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/mission/evaluate.hpp"
#include "tutti/mission/true_poses.hpp"
#include "tutti/server/map_components.hpp"

namespace tutti::mission {
namespace {

/// All robots of the largest component together, one alignment.
void measure_joint_map(const std::vector<RobotOutcome>& robots, const server::MapEstimate& map,
                       const server::MapComponents& components, const evaluation::AssociationConfig& association,
                       MissionRecord& record) {
  ServerRecord& out = record.server;
  out.components = map.components;
  out.cost = map.cost;
  out.degrees_of_freedom = map.degrees_of_freedom;
  out.from_measurements = map.from_measurements;
  out.largest_component = components.largest;
  std::vector<evaluation::PosePair> all;
  double scored_m = 0.0, whole_m = 0.0;
  for (std::size_t i = 0; i < robots.size(); ++i) {
    const MissionRecording& robot = *robots[i].recording;
    const evaluation::KeyframeTrajectory trajectory(robots[i].way(), record.robots[i].odometry);
    whole_m += trajectory.whole_m();
    if (!robot.score_against_reference || record.robots[i].component != components.largest) continue;
    const auto pairs = evaluation::associate(record.robots[i].server_estimate, robot.recording.reference, association);
    scored_m += trajectory.part_m(pairs);
    all.insert(all.end(), pairs.begin(), pairs.end());
  }
  if (const auto ate = evaluation::ate(all)) {
    out.joint.rmse_m = ate->rmse_m;
    out.joint.max_error_m = ate->max_m;
    out.joint.scored_share = whole_m > 0.0 ? scored_m / whole_m : 1.0;
    out.T_reference_world = ate->T_reference_estimate;
  }
}

void judge_closures(const server::MapServer& server, MissionRecord& record) {
  server::RefusalCounts refused = server.refusals();
  for (const server::JudgedClosure& judged : server.map().closures) {
    const auto& [from, to, measurement] = judged.closure;
    if (judged.accepted)
      record.server.closures.push_back({from, to});
    else
      server::count_refusal({RefusalReason::inconsistent}, from.chain.robot, to.chain.robot, refused);
  }
  for (const auto& [reason, count] : refused)
    record.server.rejections.push_back({reason, count.intra, count.inter, count.nearest});
}

/// Segments of odometry that the server convicted, with the times the report wants.
void name_failures(const server::MapEstimate& map, ServerRecord& out) {
  std::map<KeyframeId, Timestamp> stamp;
  for (const MapNode& node : map.nodes) stamp[node.id] = node.stamp;
  for (const server::FailedOdometry& failed : map.failed_odometry)
    out.failed_odometry.push_back({.robot = failed.chain.robot,
                                   .from = stamp.at({failed.chain, failed.from}),
                                   .until = stamp.at({failed.chain, failed.to}),
                                   .error_m = failed.jump_m,
                                   .error_rad = failed.jump_rad});
}

/// T_odom-of-robot <- world, from the server's and the raw poses of the robot's keyframes: the rigid motion that fits
/// the whole trajectory best.
std::optional<Pose3> odom_from_world(RobotId robot, const server::MapEstimate& map, std::uint32_t component) {
  std::vector<Eigen::Vector3d> odom;
  std::vector<Eigen::Vector3d> world;
  for (const MapNode& node : map.nodes) {
    if (node.id.chain.robot != robot || node.component != component) continue;
    odom.push_back(node.T_odom_body.translation);
    world.push_back(node.T_world_body.translation);
  }
  if (odom.empty()) return std::nullopt;
  return align_points(odom, world);
}

/// Where every robot's odometry frame lies in that of the first robot of its component.
void relate_robots(const std::vector<RobotOutcome>& robots, const server::MapEstimate& map,
                   const std::map<RobotId, std::uint32_t>& component, MissionRecord& record) {
  for (std::size_t i = 0; i < robots.size(); ++i)
    for (std::size_t j = i + 1; j < robots.size(); ++j) {
      const MissionRecording& a = *robots[i].recording;
      const MissionRecording& b = *robots[j].recording;
      const auto of_a = component.find(a.recording.robot);
      const auto of_b = component.find(b.recording.robot);
      if (of_a == component.end() || of_b == component.end() || of_a->second != of_b->second) continue;
      const auto T_a_world = odom_from_world(a.recording.robot, map, of_a->second);
      const auto T_b_world = odom_from_world(b.recording.robot, map, of_b->second);
      if (!T_a_world || !T_b_world) continue;
      TransformRecord transform{a.recording.name, b.recording.name, *T_a_world * T_b_world->inverse(), {}, {}};
      const auto& trajectory = b.recording.odometry;
      const auto centre =
          evaluation::centroid({trajectory.begin(), trajectory.begin() + static_cast<long>(robots[j].replayed)});
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

std::optional<ClosureCheckRecord> check_closures(const server::MapEstimate& map,
                                                 const std::vector<const MissionRecording*>& robots,
                                                 const evaluation::AssociationConfig& association,
                                                 const ClosureCheckConfig& config) {
  std::vector<LoopClosure> accepted;
  for (const server::JudgedClosure& judged : map.closures)
    if (judged.accepted) accepted.push_back(judged.closure);
  const std::map<KeyframeId, Pose3> truth = true_ends(accepted, map, robots, association);
  std::optional<ClosureCheckRecord> check;
  for (const LoopClosure& closure : accepted) {
    const auto error = closure_error(closure, truth);
    if (!error) continue;
    if (!check) check = ClosureCheckRecord{.wrong_m = config.wrong_m, .wrong_deg = config.wrong_deg};
    ++check->checked;
    check->wrong += is_wrong(*error, config) ? 1 : 0;
    check->max_error_m = std::max(check->max_error_m, error->head<3>().norm());
    check->max_error_deg = std::max(check->max_error_deg, error->tail<3>().norm() / kRadPerDeg);
  }
  return check;
}

void evaluate_server(const std::vector<RobotOutcome>& robots, const server::MapServer& server,
                     const evaluation::AssociationConfig& association, const ClosureCheckConfig& check,
                     MissionRecord& record) {
  const server::MapComponents components = server::choose_components(server.map());
  measure_joint_map(robots, server.map(), components, association, record);
  judge_closures(server, record);
  name_failures(server.map(), record.server);
  std::vector<const MissionRecording*> recordings;
  for (const RobotOutcome& robot : robots) recordings.push_back(robot.recording);
  record.server.closure_check = check_closures(server.map(), recordings, association, check);
  for (const auto& [revision, refinement] : server.state().refinements.all())
    if (refinement->whole) record.server.refinement = refinement->counts;
  record.server.graph = server.map().graph;
  for (const MapNode& node : server.map().nodes) record.server.nodes.push_back({node.id, node.stamp});
  relate_robots(robots, server.map(), components.of_robot, record);
  evaluate_map(server, association, record);
}

}  // namespace tutti::mission
