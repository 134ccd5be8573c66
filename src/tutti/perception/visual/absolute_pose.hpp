// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::visual {

struct AbsolutePoseConfig {
  double max_reprojection_px = 3.0;  ///< Of an inlier.
  int max_samples = 1000;            ///< Of RANSAC.
  double confidence = 0.9999;        ///< That one of the samples drawn had inliers alone.
};

/// A pixel of one of the body's cameras that is thought to see a known point.
struct Sighting {
  std::uint32_t camera = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 1.0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();          ///< Map frame, m.
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< Of the point.
};

struct AbsolutePose {
  Pose3 T_map_body;
  /// Right tangent. From the pixels' and the points' uncertainty, all independent, enlarged where the residuals are
  /// larger than these.
  Matrix6d covariance = Matrix6d::Identity();
  std::vector<std::uint32_t> inliers;  ///< Of the sightings, increasing.
};

/// Where the body is: P3P on three sightings of one camera in RANSAC, scored over the sightings of all cameras by the
/// truncated squared error (Torr and Zisserman, MSAC, 2000), then Gauss-Newton on the inliers with Cauchy's loss.
/// Nothing when fewer than four sightings agree; where fewer than `least_inliers` do, the search may end without them.
/// Camera indices are of `cameras`. The samples drawn are added to
/// `samples`, if asked for.
std::optional<AbsolutePose> absolute_pose(std::span<const Sighting> sightings, const std::vector<Camera>& cameras,
                                          const AbsolutePoseConfig& config, Rng rng, std::size_t least_inliers = 4,
                                          std::size_t* samples = nullptr);

}  // namespace tutti::visual
