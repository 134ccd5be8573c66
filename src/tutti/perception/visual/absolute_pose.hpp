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
  double max_reprojection_px = 3.0;  ///< Largest reprojection error of an inlier.
  int max_samples = 1000;            ///< Limit on RANSAC's samples.
  double confidence = 0.9999;        ///< RANSAC ends when one of its samples had inliers alone with this probability.
};

/// A pixel of one of the body's cameras that presumably sees a known point.
struct Sighting {
  /// Index into the cameras.
  std::uint32_t camera = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 1.0;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();          ///< Map frame, m.
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< Covariance of the point.
};

struct AbsolutePose {
  Pose3 T_map_body;
  /// Right tangent. From the uncertainty of pixels and points, taken as independent, and scaled up where the residuals
  /// are larger than that.
  Matrix6d covariance = Matrix6d::Identity();
  std::vector<std::uint32_t> inliers;  ///< Indices of sightings, increasing.
};

/// The body's pose: P3P on three sightings of one camera in RANSAC, scored over the sightings of all cameras by the
/// truncated squared error (MSAC, Torr and Zisserman 2000), then Gauss-Newton on the inliers with Cauchy's loss. No
/// value when fewer than four sightings agree; poses with fewer than `least_inliers` may be missed, because the search
/// ends when one with as many would have been found. The number of samples drawn is added to `samples` unless that is
/// null. Deterministic for a given `rng`.
std::optional<AbsolutePose> absolute_pose(std::span<const Sighting> sightings, const std::vector<Camera>& cameras,
                                          const AbsolutePoseConfig& config, Rng rng, std::size_t least_inliers = 4,
                                          std::size_t* samples = nullptr);

}  // namespace tutti::visual
