// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/closure_finders.hpp"

#include "tutti/base/check.hpp"
#include "tutti/perception/lidar/candidates.hpp"
#include "tutti/perception/lidar/verify.hpp"

namespace tutti::mission {

LidarClosureFinder::LidarClosureFinder(const lidar::LidarClosureConfig& config, int min_submap_gap)
    : config_(config), min_submap_gap_(static_cast<std::uint32_t>(min_submap_gap)) {}

bool LidarClosureFinder::is_candidate(const Submap& first, const Submap& second) const {
  const auto has_cloud = [](const Submap& s) { return s.cloud && !s.cloud->points.empty(); };
  const bool neighbours =
      first.id.robot == second.id.robot && second.id.index - first.id.index < min_submap_gap_;  // first < second
  return !neighbours && has_cloud(first) && has_cloud(second);
}

ClosureVerdict LidarClosureFinder::verify(const Submap& first, const Submap& second) const {
  const auto a = features_of(first);
  const auto b = features_of(second);
  if (!a->usable || !b->usable) return {{first.id, second.id}, {}, a->usable ? b->reason : a->reason};
  if (!lidar::plausible_pair(*a, *b, config_)) return {{first.id, second.id}, {}, "too unlike from above"};
  return lidar::to_verdict(first, second, lidar::verify_pair(*a, *b, config_));
}

std::shared_ptr<const lidar::SubmapFeatures> LidarClosureFinder::features_of(const Submap& submap) const {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = features_.find(submap.id); found != features_.end()) return found->second;
  }
  // Computed outside the lock; two threads may do it twice, with the same result.
  auto features = std::make_shared<const lidar::SubmapFeatures>(lidar::extract_features(submap, config_));
  const std::lock_guard lock(mutex_);
  return features_.try_emplace(submap.id, std::move(features)).first->second;
}

std::shared_ptr<const server::ClosureFinder> make_closure_finder(const ClosureConfig& config,
                                                                 const std::vector<MissionRecording>& recordings,
                                                                 std::uint64_t seed) {
  if (config.finder == "lidar") return std::make_shared<LidarClosureFinder>(config.lidar, config.min_submap_gap);
  TUTTI_CHECK(config.finder == "reference", "finder {}", config.finder);
  std::map<RobotId, Trajectory> reference;
  for (const MissionRecording& robot : recordings) reference[robot.recording.robot] = robot.recording.reference;
  return std::make_shared<ReferenceClosureFinder>(
      simulation::ReferenceClosures(std::move(reference), config.reference, seed));
}

}  // namespace tutti::mission
