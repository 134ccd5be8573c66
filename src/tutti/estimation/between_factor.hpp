// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/geometry/pose3.hpp"

namespace tutti::estimation {

/// Residual of a measured relative pose T_i_j, 6x1, order [translation m; rotation rad], in the measurement's frame j:
///   r = local(T_i_j_meas, T_w_i^-1 T_w_j) = [R_meas^T (t_ij - t_meas); Log(R_meas^T R_ij)]
/// (g2o's EDGE_SE3 with its information in this tangent, as GTSAM and SE-Sync read it). |Log| <= pi; at pi its sign,
/// and so the Jacobian, is ambiguous.
Vector6d between_residual(const Pose3& T_w_i, const Pose3& T_w_j, const Pose3& T_i_j_meas);

/// between_residual() with its derivatives by right perturbations T_w_i <- retract(T_w_i, xi_i), T_w_j <-
/// retract(T_w_j, xi_j). A common motion of both poses leaves r unchanged, hence J_i = -J_j Ad(T_i_j^-1).
struct BetweenLinearisation {
  Vector6d residual;
  Matrix6d J_i;
  Matrix6d J_j;
};
BetweenLinearisation linearise_between(const Pose3& T_w_i, const Pose3& T_w_j, const Pose3& T_i_j_meas);

}  // namespace tutti::estimation
