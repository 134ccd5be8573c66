// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/closure_finders.hpp"

#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/perception/lidar/candidates.hpp"
#include "tutti/perception/lidar/verify.hpp"

namespace tutti::mission {

LidarClosureFinder::LidarClosureFinder(const lidar::LidarClosureConfig& config, int min_submap_gap)
    : config_(config), min_submap_gap_(static_cast<std::uint32_t>(min_submap_gap)) {}

bool LidarClosureFinder::is_candidate(const Submap& first, const Submap& second) const {
  return first.id.robot != second.id.robot || second.id.index - first.id.index >= min_submap_gap_;  // first < second
}

Result<ClosureVerdict> LidarClosureFinder::verify(const Submap& first, const Submap& second,
                                                  const server::CloudStore& clouds) const {
  const auto features_a = features_of(first, clouds);
  if (!features_a) return tl::unexpected(features_a.error());
  const auto features_b = features_of(second, clouds);
  if (!features_b) return tl::unexpected(features_b.error());
  const auto& a = *features_a;
  const auto& b = *features_b;
  if (!a->usable || !b->usable) return ClosureVerdict{{first.id, second.id}, {}, a->usable ? b->reason : a->reason};
  if (!lidar::plausible_pair(*a, *b, config_))
    return ClosureVerdict{{first.id, second.id}, {}, "too unlike from above"};
  return lidar::to_verdict(first, second, lidar::verify_pair(*a, *b, config_));
}

Result<std::shared_ptr<const lidar::SubmapFeatures>> LidarClosureFinder::features_of(
    const Submap& submap, const server::CloudStore& clouds) const {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = features_.find(submap.id); found != features_.end()) return found->second;
  }
  auto cloud = clouds.get(submap.id);
  if (!cloud) return tl::unexpected(cloud.error());
  Submap seen = submap;
  seen.cloud = std::move(*cloud);
  // Computed outside the lock; two threads may do it twice, with the same result.
  auto features = std::make_shared<const lidar::SubmapFeatures>(lidar::extract_features(seen, config_));
  const std::lock_guard lock(mutex_);
  return features_.try_emplace(submap.id, std::move(features)).first->second;
}

namespace {

std::shared_ptr<const server::ClosureFinder> make_honest_finder(const ClosureConfig& config,
                                                                const std::vector<MissionRecording>& recordings,
                                                                std::uint64_t seed) {
  if (config.finder == "lidar") return std::make_shared<LidarClosureFinder>(config.lidar, config.min_submap_gap);
  TUTTI_CHECK(config.finder == "reference", "finder {}", config.finder);
  std::map<RobotId, Trajectory> reference;
  for (const MissionRecording& robot : recordings) reference[robot.recording.robot] = robot.recording.reference;
  return std::make_shared<ReferenceClosureFinder>(
      simulation::ReferenceClosures(std::move(reference), config.reference, seed));
}

}  // namespace

std::shared_ptr<const server::ClosureFinder> make_closure_finder(const ClosureConfig& config,
                                                                 const std::vector<MissionRecording>& recordings,
                                                                 std::uint64_t seed) {
  auto finder = make_honest_finder(config, recordings, seed);
  if (config.wrong_share == 0.0) return finder;
  return std::make_shared<SpoiledClosureFinder>(std::move(finder), config.wrong_share, config.wrong, seed);
}

}  // namespace tutti::mission
