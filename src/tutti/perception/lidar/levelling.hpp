// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>

namespace tutti::lidar {

/// Direction "up" as the surfaces show it: floors and ceilings have vertical normals, walls horizontal ones.
struct UpDirection {
  Eigen::Vector3d up;
  double support = 0.0;  ///< Share of the normals that are vertical or horizontal to `kUpToleranceDeg`.
};

inline constexpr double kUpToleranceDeg = 5.0;

/// Refines `prior` (unit, within about 25 degrees of the truth) from unit normals (zero ones are ignored):
/// minimises sum over walls (n . up)^2 + sum over floors 1 - (n . up)^2 with a narrowing choice of either.
UpDirection refine_up(std::span<const Eigen::Vector3f> normals, const Eigen::Vector3d& prior);

}  // namespace tutti::lidar
