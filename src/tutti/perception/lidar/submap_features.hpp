// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "tutti/model/refusal.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/perception/lidar/bend.hpp"
#include "tutti/perception/lidar/birds_eye_view.hpp"
#include "tutti/perception/lidar/closure_config.hpp"
#include "tutti/perception/lidar/oriented_cloud.hpp"
#include "tutti/perception/lidar/visibility.hpp"

namespace tutti::lidar {

/// All that verifying pairs needs of one submap, computed once. Immutable; copies share the heavy parts.
struct SubmapFeatures {
  SubmapId id;
  bool usable = false;
  std::optional<Refusal> refusal;  ///< Why the submap is not usable.
  OrientedCloud cloud;             ///< Submap frame, Morton order.
  /// Turns the submap frame about a horizontal axis so that z points up.
  Eigen::Quaterniond R_level_submap = Eigen::Quaterniond::Identity();
  /// Position of the middle keyframe (submap_middle.hpp), submap frame, m.
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  std::shared_ptr<const Bend> bend;
  BirdsEyeView view;
  std::shared_ptr<const std::vector<TurnedView>> turned_views;
  std::shared_ptr<const std::vector<DepthPanorama>> panoramas;  ///< Submap frame, from viewpoints along the trajectory.
};

/// Computes the features; pure and deterministic. A submap that is too short, too small or without a cloud has usable =
/// false and a refusal.
SubmapFeatures extract_features(const Submap& submap, const LidarClosureConfig& config);

/// The features of the same submap with its up taken for its down.
SubmapFeatures turned_over(SubmapFeatures features, const LidarClosureConfig& config);

/// Only the turned views of these features, for half the work; none when the submap is not usable or has not enough
/// walls.
std::vector<TurnedView> views_from_above(const Submap& submap, const LidarClosureConfig& config);

/// Memory used in bytes, with what copies share.
std::size_t bytes_of(const SubmapFeatures& features);

}  // namespace tutti::lidar
