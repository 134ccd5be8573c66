// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <mutex>

#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recently_used.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/perception/lidar/submap_features.hpp"
#include "tutti/server/closure_finder.hpp"

namespace tutti::mission {

/// From the submap clouds alone. Features, up to 1.5 MB a submap, stay in memory of the first `kept_in_memory` submaps;
/// of the others those used last, and else they are computed again. (Each new submap meets all others in turn: were
/// those used last kept of all, hardly any would still be there when it is wanted.)
class LidarClosureFinder final : public server::ClosureFinder {
 public:
  LidarClosureFinder(const lidar::LidarClosureConfig& config, int min_submap_gap, std::size_t kept_in_memory = 1000);
  [[nodiscard]] bool needs_clouds() const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override;
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::CloudStore& clouds) const override;

 private:
  [[nodiscard]] Result<std::shared_ptr<const lidar::SubmapFeatures>> features_of(
      const Submap& submap, const server::CloudStore& clouds) const;

  lidar::LidarClosureConfig config_;
  std::uint32_t min_submap_gap_;
  std::size_t kept_in_memory_;
  mutable std::mutex mutex_;  // guards features_ and recent_
  mutable std::map<SubmapId, std::shared_ptr<const lidar::SubmapFeatures>> features_;
  mutable RecentlyUsed<lidar::SubmapFeatures> recent_{16};  // of submaps that are not in features_
};

/// For recordings without sensor data: true relative poses plus noise and a share of wrong ones.
class ReferenceClosureFinder final : public server::ClosureFinder {
 public:
  explicit ReferenceClosureFinder(std::shared_ptr<const simulation::ReferenceClosures> closures)
      : closures_(std::move(closures)) {}
  [[nodiscard]] bool needs_clouds() const override { return false; }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    return closures_->is_candidate(first, second);
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::CloudStore&) const override {
    return closures_->verify(first, second);
  }

 private:
  std::shared_ptr<const simulation::ReferenceClosures> closures_;
};

/// What load_input() accepts is complete: planted closures name robots of the mission.
std::shared_ptr<const server::ClosureFinder> make_closure_finder(const ClosureConfig& config,
                                                                 const std::vector<MissionRecording>& recordings,
                                                                 std::uint64_t seed);

}  // namespace tutti::mission
