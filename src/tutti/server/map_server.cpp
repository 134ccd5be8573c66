// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_server.hpp"

#include <string>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/server/graph_monitor.hpp"

namespace tutti::server {
namespace {

/// Between neighbouring keyframes. Odometry that diverged beyond this would leave the joint map without a solution.
constexpr double kLongestStep_m = 1e4;
/// By which odometry may differ from the poses it made: what rounding leaves, however far away they are.
constexpr double kRounding_m = 0.01;
constexpr double kRounding_rad = 1e-3;

/// Odometry is what leads from one keyframe's pose to the next.
Status check_step(const Keyframe& from, const Keyframe& to, const RelativePose& step) {
  if (!is_valid(step.T_a_b) || step.T_a_b.translation.norm() > kLongestStep_m)
    return fail(ErrorCode::invalid, "odometry of {} m to keyframe {}, expected at most {} m",
                step.T_a_b.translation.norm(), to.index, kLongestStep_m);
  const Vector6d apart = local(from.T_odom_body.inverse() * to.T_odom_body, step.T_a_b);
  const double apart_m = apart.head<3>().norm(), apart_rad = apart.tail<3>().norm();
  if (apart_m > kRounding_m || apart_rad > kRounding_rad)
    return fail(ErrorCode::invalid, "odometry to keyframe {} is {:.3f} m and {:.3f} rad from its poses, expected 0",
                to.index, apart_m, apart_rad);
  if (auto ok = check_covariance(step.covariance); !ok)
    return in_context(fmt::format("odometry to keyframe {}", to.index), ok.error());
  return {};
}

/// What the map relies on, also of callers who do not come by wire.
Status check_submap(const Submap& submap) {
  const std::string where = fmt::format("submap {}/{}", submap.id.robot.value, submap.id.index);
  if (submap.keyframes.empty() || submap.odometry.size() + 1 != submap.keyframes.size())
    return fail(ErrorCode::invalid, "{}: {} keyframes and {} odometry factors, expected n and n - 1, n >= 1", where,
                submap.keyframes.size(), submap.odometry.size());
  for (std::size_t k = 0; k < submap.keyframes.size(); ++k) {
    const Keyframe& keyframe = submap.keyframes[k];
    if (!is_valid(keyframe.T_odom_body))
      return fail(ErrorCode::invalid, "{}: keyframe {} has no valid pose", where, keyframe.index);
    if (k == 0) continue;
    const Keyframe& previous = submap.keyframes[k - 1];
    if (keyframe.index != previous.index + 1 || keyframe.stamp <= previous.stamp)
      return fail(ErrorCode::invalid, "{}: keyframe {} at {} ns does not follow keyframe {} at {} ns", where,
                  keyframe.index, keyframe.stamp.ns, previous.index, previous.stamp.ns);
    if (auto ok = check_step(previous, keyframe, submap.odometry[k - 1]); !ok) return in_context(where, ok.error());
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
  if (const auto known = state_.submaps.find(id); known != state_.submaps.end()) {
    if (known->second->keyframes == message.submap.keyframes) return replace_lost_cloud(message.submap);
    return fail(ErrorCode::invalid,
                "submap {}/{} differs from the one in the map: has robot {} restarted without its saved state?",
                id.robot.value, id.index, id.robot.value);
  }
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

Status MapServer::replace_lost_cloud(const Submap& duplicate) {
  const auto size = state_.cloud_sizes.find(duplicate.id);
  if (size == state_.cloud_sizes.end() || duplicate.cloud == nullptr ||
      duplicate.cloud->points.size() != size->second || clouds_->get(duplicate.id))
    return {};
  return clouds_->put(duplicate.id, duplicate.cloud);
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

void MapServer::give_back(VerificationJob job) {
  if (asked_.contains(job.pair) && !state_.verdicts.contains(job.pair)) jobs_.push_back(std::move(job));
}

Status MapServer::receive(const ClosureVerdict& verdict) {
  const auto& [pair, closures, reason] = verdict;
  const std::string where = fmt::format("verdict on submaps {}/{} and {}/{}", pair.first.robot.value, pair.first.index,
                                        pair.second.robot.value, pair.second.index);
  if (!state_.submaps.contains(pair.first) || !state_.submaps.contains(pair.second))
    return fail(ErrorCode::invalid, "{}: not both are in the map", where);
  for (const LoopClosure& closure : closures) {
    if (!is_valid(closure.measurement.T_a_b)) return fail(ErrorCode::invalid, "{}: its closure is no pose", where);
    if (auto ok = check_covariance(closure.measurement.covariance); !ok) return in_context(where, ok.error());
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
