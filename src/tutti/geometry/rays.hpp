// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace tutti {

/// A half line. All rays of one call are in one frame, m.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< Unit length.
};

/// The point with the least sum of squared distances to the lines of the rays, m; no value for fewer than two rays or
/// rays that are all parallel.
std::optional<Eigen::Vector3d> nearest_point(std::span<const Ray> rays);

/// Largest angle between two of the rays, rad; zero for fewer than two rays.
double largest_angle(std::span<const Ray> rays);

}  // namespace tutti
