// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/localise/known_map.hpp"
#include "tutti/perception/lidar/closure_config.hpp"
#include "tutti/perception/lidar/submap_features.hpp"

namespace tutti::localise {

/// The map around one place: the clouds of the nearest submaps as one.
struct LocalMap {
  std::vector<SubmapId> submaps;  ///< By id.
  std::uint32_t floor = 1;
  Pose3 T_world_local;  ///< The frame of the cloud, near it, so that its coordinates are small.
  lidar::OrientedCloud cloud;
  struct Viewer {
    Pose3 T_submap_local;
    std::shared_ptr<const lidar::SubmapFeatures> features;
  };
  std::vector<Viewer> viewers;  ///< One a submap, which tells what was seen through.
};

/// Makes local maps, and keeps the last one and the features of the submaps about it: memory does not grow with the
/// map.
class LocalMaps {
 public:
  LocalMaps(std::shared_ptr<const KnownMap> map, lidar::LidarClosureConfig config)
      : map_(std::move(map)), config_(std::move(config)) {}

  /// The local map about a point; null where its floor has no cloud within kReach_m.
  const LocalMap* about(const OnFloor& p_world);
  using Features = std::shared_ptr<const lidar::SubmapFeatures>;
  /// Those of a submap of the map, never null; computed once while they are kept. An error: its cloud cannot be read.
  Result<Features> features_of(SubmapId id);
  [[nodiscard]] const lidar::LidarClosureConfig& config() const { return config_; }
  static constexpr double kReach_m = 25.0;
  static constexpr std::size_t kMostSubmaps = 6;
  static constexpr std::size_t kMostKept = 64;  ///< Features of submaps, those used last.

  [[nodiscard]] std::size_t made() const { return made_; }            ///< Local maps.
  [[nodiscard]] std::size_t extracted() const { return extracted_; }  ///< Submaps whose features were computed.

 private:
  std::shared_ptr<const KnownMap> map_;
  lidar::LidarClosureConfig config_;
  struct Kept {
    Features features;
    std::size_t used = 0;  ///< The last of so many uses.
  };
  std::map<SubmapId, Kept> features_;
  std::size_t uses_ = 0;
  LocalMap local_;
  std::size_t made_ = 0, extracted_ = 0;
};

}  // namespace tutti::localise
