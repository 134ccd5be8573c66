// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/true_poses.hpp"

#include "tutti/geometry/so3.hpp"

namespace tutti::mission {

std::map<KeyframeId, Pose3> true_ends(std::span<const LoopClosure> closures, const server::MapEstimate& map,
                                      const std::vector<const MissionRecording*>& robots,
                                      const evaluation::AssociationConfig& association) {
  std::map<RobotId, std::map<Timestamp, KeyframeId>> ends;
  for (const LoopClosure& closure : closures)
    for (const KeyframeId& id : {closure.from, closure.to})
      if (const MapNode* node = server::find_node(map, id)) ends[id.chain.robot][node->stamp] = id;
  std::map<KeyframeId, Pose3> out;
  for (const MissionRecording* robot : robots) {
    const auto& own = ends[robot->recording.robot];
    Trajectory stamps;
    for (const auto& [stamp, id] : own) stamps.push_back({stamp, {}});
    for (const auto& pair : evaluation::associate(stamps, robot->recording.reference, association))
      out[own.at(pair.stamp)] = pair.reference;
  }
  return out;
}

std::optional<Vector6d> closure_error(const LoopClosure& closure, const std::map<KeyframeId, Pose3>& truth) {
  const auto from = truth.find(closure.from);
  const auto to = truth.find(closure.to);
  if (from == truth.end() || to == truth.end()) return std::nullopt;
  return local(from->second.inverse() * to->second, closure.measurement.T_a_b);
}

bool is_wrong(const Vector6d& error, const ClosureCheckConfig& check) {
  return error.head<3>().norm() > check.wrong_m || error.tail<3>().norm() > check.wrong_deg * kRadPerDeg;
}

}  // namespace tutti::mission
