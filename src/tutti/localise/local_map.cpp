// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/local_map.hpp"

#include <algorithm>
#include <utility>

namespace tutti::localise {
namespace {

/// The map is made anew when the place has come nearer to another submap, but not at every step between two.
constexpr double kStays_m = 4.0;

}  // namespace

Result<LocalMaps::Features> LocalMaps::features_of(SubmapId id) {
  if (const auto kept = features_.find(id); kept != features_.end()) {
    kept->second.used = ++uses_;
    return kept->second.features;
  }
  auto cloud = map_->payloads->cloud(id);
  if (!cloud) return tl::unexpected(cloud.error());
  Submap submap = *map_->submaps.at(id).submap;
  submap.cloud = std::move(*cloud);
  if (features_.size() >= kMostKept)
    features_.erase(std::ranges::min_element(features_, {}, [](const auto& kept) { return kept.second.used; }));
  ++extracted_;
  auto features = std::make_shared<const lidar::SubmapFeatures>(lidar::extract_features(submap, config_));
  features_[id] = {features, ++uses_};
  return features;
}

const LocalMap* LocalMaps::about(const OnFloor& p_world) {
  const bool stays = !local_.submaps.empty() && local_.floor == p_world.floor &&
                     (local_.T_world_local.translation - p_world.p).norm() < kStays_m;
  if (stays) return local_.viewers.empty() ? nullptr : &local_;
  std::vector<SubmapId> submaps = map_->near(p_world, kReach_m, kMostSubmaps);
  std::ranges::sort(submaps);
  if (submaps == local_.submaps && !submaps.empty()) return local_.viewers.empty() ? nullptr : &local_;
  const Pose3 T_world_local{Eigen::Quaterniond::Identity(), p_world.p};
  local_ = {.submaps = std::move(submaps), .floor = p_world.floor, .T_world_local = T_world_local};
  std::vector<lidar::PosedOriented> parts;
  for (const SubmapId& id : local_.submaps) {
    const auto features = features_of(id);
    if (!features || !(*features)->usable) continue;  // nothing is shown there
    const Pose3 T_local_submap = T_world_local.inverse() * map_->submaps.at(id).T_world_submap;
    local_.viewers.push_back({T_local_submap.inverse(), *features});
    parts.push_back({T_local_submap, &(*features)->cloud});
  }
  if (parts.empty()) return nullptr;
  ++made_;
  local_.cloud = lidar::joined(parts);
  return &local_;
}

}  // namespace tutti::localise
