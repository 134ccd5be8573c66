// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/perfect_course.hpp"

#include <utility>

#include "tutti/evaluation/agreement.hpp"
#include "tutti/mission/perfect_judge.hpp"

namespace tutti::mission {
namespace {

std::map<RobotId, double> errors_at(const ProxyGraph& broadcast, const server::MapEstimate& map,
                                    const std::vector<const MissionRecording*>& robots,
                                    const evaluation::AssociationConfig& association) {
  std::map<std::pair<ChainId, Timestamp>, Pose3> poses;
  for (const MapNode& node : map.nodes) poses.emplace(std::pair(node.id.chain, node.stamp), node.T_world_body);
  std::map<RobotId, std::map<ChainId, Trajectory>> trajectories;
  for (const ProxyNode& node : broadcast.nodes)
    if (const auto pose = poses.find({node.chain, node.stamp}); pose != poses.end())
      trajectories[node.chain.robot][node.chain].push_back({node.stamp, pose->second});
  std::map<RobotId, double> out;
  for (const MissionRecording* robot : robots) {
    const auto found = trajectories.find(robot->recording.robot);
    if (found == trajectories.end() || !robot->score_against_reference) continue;
    const Trajectory& newest = found->second.rbegin()->second;
    Trajectory truth;
    for (const auto& pair : evaluation::associate(newest, robot->recording.reference, association))
      truth.push_back({pair.stamp, pair.reference});
    if (const auto error = evaluation::agreement(newest, truth)) out[found->first] = error->rmse_m;
  }
  return out;
}

}  // namespace

void PerfectCourse::update(const server::MapServer& server, const ProxyGraph& broadcast,
                           const server::MapConfig& config, const std::vector<const MissionRecording*>& robots,
                           const evaluation::AssociationConfig& association, const ClosureCheckConfig& check) {
  const server::ServerWork& work = server.work();
  const auto affordable = kShare * static_cast<double>(work.search.factorisations);
  if (static_cast<double>(factorisations_ + last_) > affordable) return;
  const auto map = judge_perfectly(server, config, robots, association, check);
  if (!map) return;
  last_ = map->work.factorisations;
  factorisations_ += last_;
  rmse_m_[server.state().revision] = errors_at(broadcast, *map, robots, association);
}

std::optional<double> PerfectCourse::rmse_m(std::uint64_t revision, RobotId robot) const {
  const auto update = rmse_m_.find(revision);
  if (update == rmse_m_.end()) return std::nullopt;
  const auto found = update->second.find(robot);
  return found != update->second.end() ? std::optional(found->second) : std::nullopt;
}

}  // namespace tutti::mission
