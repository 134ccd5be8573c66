// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

#include "tutti/model/pose_graph.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::estimation::internal {

/// A run of odometry steps T_k-1_k, k = 1..m, between two nodes a = 0 and b = m, linearised about poses X_k. With
/// E_k = X_k-1^-1 X_k and r_k = local(T_k-1_k, E_k), a step gives
///   delta_k = Ad(E_k^-1) delta_k-1 + b_k + w_k,   b_k = -G_k^-1 r_k,   w_k ~ N(0, G_k^-1 Q_k G_k^-T),
/// G_k = d r_k / d delta_k. In the tangent of node a, zeta_k = Ad(C_k) delta_k with C_k = X_a^-1 X_k, the transport is
/// the identity, so a whole run is a plain sum of its steps:
///   zeta_b = zeta_a + offset + w,   w ~ N(0, covariance).
struct RunSum {
  Pose3 T_a_b;
  Vector6d offset = Vector6d::Zero();
  Matrix6d covariance = Matrix6d::Zero();
};

/// Raw odometry: X_k composed, every r_k = 0, so the offset is zero.
RunSum sum_odometry(std::span<const RelativePose> steps);
/// About given poses (one more than steps).
RunSum sum_about(std::span<const RelativePose> steps, std::span<const Pose3> poses);

/// The run as the edge of a pose graph: residual, gradient and Hessian of that edge, linearised at T_a_b, are the
/// run's.
PoseGraphEdge as_edge(const RunSum& run, std::size_t from, std::size_t to);

/// The most likely inner perturbations given those of both ends, delta_a and delta_b, each in its own tangent: zeta_k
/// follows w_k = Q'_k Ad(C_k)^T lambda with lambda = covariance^-1 (zeta_b - zeta_a - offset). Applies them to poses
/// 1..m-1 in place; the ends are left to the caller.
void distribute_about(std::span<const RelativePose> steps, const RunSum& run, const Vector6d& delta_a,
                      const Vector6d& delta_b, std::span<Pose3> poses);
/// The same for raw odometry, `run` being as_edge(sum_odometry(steps)): bent to meet the poses of both ends, the first
/// and the last of `poses`; writes those between.
void distribute_odometry(std::span<const RelativePose> steps, const PoseGraphEdge& run, std::span<Pose3> poses);

/// To first order about `poses`, how the inner poses move with the ends: 6 rows each, columns as those of the ends'
/// moves.
Eigen::MatrixXd spread_about(std::span<const RelativePose> steps, std::span<const Pose3> poses,
                             const Eigen::Ref<const Eigen::MatrixXd>& deltas_a,
                             const Eigen::Ref<const Eigen::MatrixXd>& deltas_b);

}  // namespace tutti::estimation::internal
