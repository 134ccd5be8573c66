// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <vector>

#include "tutti/model/submap.hpp"
#include "tutti/perception/lidar/closure_config.hpp"
#include "tutti/perception/lidar/oriented_cloud.hpp"
#include "tutti/perception/lidar/visibility.hpp"

namespace tutti::lidar {

/// A piece of wall seen from above; level frame, relative to BirdsEyeView::centre.
struct WallCell {
  Eigen::Vector2f position;  ///< m
  Eigen::Vector2f normal;    ///< Mean horizontal normal of its points times the root of their number.
};

/// A piece of floor (its normal points up) or ceiling.
struct FloorCell {
  Eigen::Vector2f position;  ///< m, level frame, relative to BirdsEyeView::centre.
  float height;              ///< m, level frame.
  bool faces_up;
};

/// A submap from above, ready for correlation (candidates.hpp).
struct BirdsEyeView {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< Of the walls, level frame.
  std::vector<WallCell> walls;
  std::vector<FloorCell> floors;
};

/// Everything about one submap that comparing it needs, computed once. Immutable; copies share the heavy parts.
struct SubmapFeatures {
  SubmapId id;
  bool usable = false;
  std::string reason;   ///< Why not usable.
  OrientedCloud cloud;  ///< Submap frame, Morton order.
  /// Turns the submap frame so that z points up, yaw left alone (a rotation about a horizontal axis).
  Eigen::Quaterniond R_level_submap = Eigen::Quaterniond::Identity();
  BirdsEyeView view;
  std::shared_ptr<const std::vector<DepthPanorama>> panoramas;  ///< Submap frame, from viewpoints along the way.
};

/// Pure and deterministic. A submap that is too short, too small or without a cloud comes back with usable = false.
SubmapFeatures extract_features(const Submap& submap, const LidarClosureConfig& config);

}  // namespace tutti::lidar
