// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>

namespace tutti::lidar {

/// The direction up as the surfaces show it: floors and ceilings have vertical normals, walls horizontal ones.
struct UpDirection {
  Eigen::Vector3d up;    ///< Unit, in the frame of the normals.
  double support = 0.0;  ///< Share of the normals that are vertical or horizontal to `kUpToleranceDeg`.
};

inline constexpr double kUpToleranceDeg = 5.0;

/// Refines `prior` (unit, within about 25 degrees of the truth) from unit normals; zero normals are ignored. Minimises
/// the sum over walls of (n . up)^2 plus the sum over floors of 1 - (n . up)^2, with walls and floors chosen by a
/// narrowing tolerance. Where too few normals or walls of one direction only determine up, the last estimate stays.
UpDirection refine_up(std::span<const Eigen::Vector3f> normals, const Eigen::Vector3d& prior);

}  // namespace tutti::lidar
