// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::lidar {

/// How a submap may be bent inside: what odometry is worth between its keyframes, as seen from its middle keyframe.
struct Bend {
  std::vector<Eigen::Vector3d> viewpoints;  ///< Of the keyframes, submap frame.
  std::vector<Matrix6d> steps;              ///< From keyframe k to k + 1: covariance of a twist in the submap frame.
  std::size_t middle = 0;                   ///< The keyframe that counts as unbent.
};

Bend find_bend(const Submap& submap);

/// Where two clouds that lie on each other touch: with a right perturbation xi of T_target_source the distance from the
/// source point to the target's surface changes by gradient . xi.
struct Contact {
  Eigen::Vector3d target, source;  ///< Each in the frame of its submap.
  Vector6d gradient;
  double weight = 1.0;
};

/// What bends both submaps does to the registration: covariance of the right perturbation of T_target_source between
/// the two as their middle keyframes see them. A voxel is the mean of what hit it, and a sensor that looks all round
/// hits it in proportion to 1 / distance^2: so much of point p moves with keyframe k, w_k(p). An error eta of the step
/// from k to k + 1, beyond the middle, moves p by the share B(p) = sum of w over the keyframes beyond the step, and the
/// least squares by H^-1 (sum B(p) g g^T) eta, with H = sum g g^T: the mean of the shares where the clouds touch.
Matrix6d bend_covariance(const Bend& target, const Bend& source, const Pose3& T_target_source,
                         std::span<const Contact> contacts);

}  // namespace tutti::lidar
