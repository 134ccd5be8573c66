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

namespace tutti::lidar {

/// A piece of wall seen from above, level frame.
struct WallCell {
  Eigen::Vector2f position;  ///< m, relative to BirdsEyeView::centre.
  Eigen::Vector2f normal;    ///< Sum of the horizontal normals of its points, saturated.
};

/// Walls from above, ready for correlation (candidates.cpp). Image of a complex field: normal.x + i normal.y.
struct BirdsEyeView {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< Level frame.
  std::vector<WallCell> walls;
  double norm = 0.0;  ///< Of the image.
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
};

/// Pure and deterministic. A submap that is too short, too small or without a cloud comes back with usable = false.
SubmapFeatures extract_features(const Submap& submap, const LidarClosureConfig& config);

}  // namespace tutti::lidar
