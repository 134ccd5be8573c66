// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::lidar {

/// How a submap may be bent inside, because its cloud was put together by odometry: the odometry's uncertainty between
/// its keyframes, relative to its middle keyframe.
struct Bend {
  std::vector<Eigen::Vector3d> viewpoints;  ///< Positions of the keyframes, submap frame, m.
  std::vector<Matrix6d> steps;  ///< Step from keyframe k to k + 1: covariance of a twist [m; rad] in the submap frame.
  std::size_t middle = 0;       ///< The keyframe that counts as unbent.
};

/// From the submap's keyframes and the covariances of its odometry.
Bend find_bend(const Submap& submap);

/// A point where two aligned clouds touch. With a right perturbation xi of T_target_source the distance from the source
/// point to the target's surface changes by gradient . xi.
struct Contact {
  Eigen::Vector3d target, source;  ///< Each in the frame of its submap.
  Vector6d gradient;
  double weight = 1.0;
};

/// The covariance that the bends of both submaps add to a registration: of the right perturbation of T_target_source,
/// both submaps seen from their middle keyframes. A voxel is the mean of what hit it, and a sensor that looks all round
/// hits it in proportion to 1 / distance^2, so point p moves with keyframe k by the share w_k(p) ~ 1 / distance^2. An
/// error eta of the step from k to k + 1, beyond the middle, moves p by the share B(p), the sum of w over the keyframes
/// beyond the step, and the least-squares estimate by H^-1 (sum B(p) g g^T) eta, H = sum g g^T over the contacts with
/// gradients g. docs/math.md, "LiDAR closures".
Matrix6d bend_covariance(const Bend& target, const Bend& source, const Pose3& T_target_source,
                         std::span<const Contact> contacts);

}  // namespace tutti::lidar
