// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_server.hpp"

#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/server/graph_monitor.hpp"

namespace tutti::server {
namespace {

/// What the wire cannot know: the submap must agree with the keyframes that are already there.
Status check_submap(const Submap& submap) {
  if (submap.keyframes.empty() || submap.odometry.size() + 1 != submap.keyframes.size())
    return fail(ErrorCode::invalid, "submap {}/{}: {} keyframes and {} odometry factors, expected n and n - 1, n >= 1",
                submap.id.robot.value, submap.id.index, submap.keyframes.size(), submap.odometry.size());
  for (std::size_t k = 0; k < submap.keyframes.size(); ++k) {
    const Keyframe& keyframe = submap.keyframes[k];
    if (!is_valid(keyframe.T_odom_body))
      return fail(ErrorCode::invalid, "submap {}/{}: keyframe {} has no valid pose", submap.id.robot.value,
                  submap.id.index, keyframe.index);
    if (k == 0) continue;
    const Keyframe& previous = submap.keyframes[k - 1];
    if (keyframe.index != previous.index + 1 || keyframe.stamp <= previous.stamp)
      return fail(ErrorCode::invalid, "submap {}/{}: keyframe {} at {} ns does not follow keyframe {} at {} ns",
                  submap.id.robot.value, submap.id.index, keyframe.index, keyframe.stamp.ns, previous.index,
                  previous.stamp.ns);
  }
  return {};
}

SubmapPair ordered(SubmapId a, SubmapId b) { return a < b ? SubmapPair{a, b} : SubmapPair{b, a}; }

}  // namespace

MapServer::MapServer(std::set<RobotId> robots, std::shared_ptr<const ClosureFinder> finder,
                     std::shared_ptr<CloudStore> clouds, const ServerConfig& config)
    : MapServer(std::move(robots), std::move(finder), std::move(clouds), config, MapServerState{}) {}

MapServer::MapServer(std::set<RobotId> robots, std::shared_ptr<const ClosureFinder> finder,
                     std::shared_ptr<CloudStore> clouds, const ServerConfig& config, MapServerState state)
    : robots_(std::move(robots)),
      finder_(std::move(finder)),
      clouds_(std::move(clouds)),
      config_(config),
      state_(std::move(state)) {
  TUTTI_CHECK(finder_ != nullptr && clouds_ != nullptr, "no finder or no store of clouds");
  for (const auto& [pair, verdict] : state_.verdicts) asked_.insert(pair);
  for (const auto& [id, submap] : state_.submaps) plan_verifications(submap);
  news_ = !state_.submaps.empty();
}

Status MapServer::receive(const SubmapMessage& message) {
  const SubmapId id = message.submap.id;
  if (!robots_.contains(message.header.robot) || message.header.robot != id.robot)
    return fail(ErrorCode::unknown_robot,
                "submap {}/{} from robot {}: expected one of the mission's {} robots, as sender", id.robot.value,
                id.index, message.header.robot.value, robots_.size());
  if (auto ok = check_submap(message.submap); !ok) return ok;
  if (state_.submaps.contains(id)) return {};  // a duplicate
  const std::shared_ptr<const PointCloud>& cloud = message.submap.cloud;
  if (cloud != nullptr && !cloud->points.empty()) {
    if (auto ok = clouds_->put(id, cloud); !ok) return ok;
    state_.cloud_sizes[id] = cloud->points.size();
  }
  Submap submap = message.submap;
  submap.cloud.reset();
  const auto& kept = state_.submaps[id] = std::make_shared<const Submap>(std::move(submap));
  plan_verifications(kept);
  news_ = true;
  return {};
}

bool MapServer::may_be_verified(SubmapId id) const {
  return !finder_->needs_clouds() || state_.cloud_sizes.contains(id);
}

void MapServer::plan_verifications(const std::shared_ptr<const Submap>& submap) {
  if (!may_be_verified(submap->id)) return;
  for (const auto& [id, other] : state_.submaps) {
    if (id == submap->id || !may_be_verified(id)) continue;
    const SubmapPair pair = ordered(id, submap->id);
    if (asked_.contains(pair)) continue;
    const auto& first = id < submap->id ? other : submap;
    const auto& second = id < submap->id ? submap : other;
    if (!finder_->is_candidate(*first, *second)) continue;
    asked_.insert(pair);
    jobs_.push_back({pair, first, second});
  }
}

std::vector<VerificationJob> MapServer::take_jobs() { return std::exchange(jobs_, {}); }

Status MapServer::receive(const ClosureVerdict& verdict) {
  const auto& [pair, closures, reason] = verdict;
  if (!state_.submaps.contains(pair.first) || !state_.submaps.contains(pair.second))
    return fail(ErrorCode::invalid, "verdict on submaps {}/{} and {}/{}: not both are in the map",
                pair.first.robot.value, pair.first.index, pair.second.robot.value, pair.second.index);
  for (const LoopClosure& closure : closures) {
    if (!is_valid(closure.measurement.T_a_b) || !closure.measurement.covariance.allFinite())
      return fail(ErrorCode::invalid, "verdict on submaps {}/{} and {}/{}: its closure is not finite",
                  pair.first.robot.value, pair.first.index, pair.second.robot.value, pair.second.index);
  }
  const auto [entry, is_new] = state_.verdicts.try_emplace(pair, verdict);
  if (is_new && !closures.empty()) news_ = true;
  return {};
}

ProxyGraphMessage MapServer::optimise() {
  news_ = false;
  map_ = estimate_map(state_.submaps, state_.verdicts, config_.map);
  ++state_.revision;
  return {.header = {.robot = {}, .session = 0, .sequence = state_.revision},
          .graph = monitor_graph(map_, state_.revision, config_.proxy_graph)};
}

}  // namespace tutti::server
