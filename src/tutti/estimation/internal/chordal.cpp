// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/chordal.hpp"

#include <Eigen/LU>
#include <cmath>

#include "tutti/estimation/internal/block_cholesky.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::estimation::internal {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Closest rotation by Newton's iteration for the polar factor (Higham 1986), about ten times faster than an SVD; which
/// remains for reflections and near-singular matrices.
Matrix3d closest_rotation(const Matrix3d& m) {
  constexpr int kMaxIterations = 12;
  constexpr double kTolerance = 1e-12;
  Matrix3d x = m / m.norm();
  if (x.determinant() < 1e-4) return project_to_so3(m);
  for (int k = 0; k < kMaxIterations; ++k) {
    const Matrix3d inverse_transpose = x.inverse().transpose();
    const double scale = std::sqrt(inverse_transpose.norm() / x.norm());
    const Matrix3d next = 0.5 * (scale * x + inverse_transpose / scale);
    const double change = (next - x).squaredNorm();
    x = next;
    if (change < kTolerance) return x;  // quadratic: the next change would be below 1e-12 squared
  }
  return project_to_so3(m);
}

double mean_rotational_information(const PoseGraphEdge& edge) {
  return edge.information.bottomRightCorner<3, 3>().trace() / 3.0;
}

/// Rows of R_i as unknowns: r_j^T - r_i^T R_ij for each of the three rows r. False = singular.
bool solve_rotations(const PoseGraph& graph, const BlockStructure& s, BlockCholesky& cholesky,
                     std::vector<Matrix3d>& R) {
  Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(3 * s.variables, 3);
  cholesky.set_zero();
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const auto& edge = graph.edges[e];
    if (edge.from == edge.to) continue;
    const auto& slot = s.edges[e];
    const double kappa = mean_rotational_information(edge);
    const Matrix3d weighted = kappa * edge.T_from_to.rotation.toRotationMatrix();
    const Matrix3d diagonal = kappa * Matrix3d::Identity();
    if (slot.from >= 0) cholesky.add_diagonal(slot.from, diagonal);
    if (slot.to >= 0) cholesky.add_diagonal(slot.to, diagonal);
    cholesky.add_edge(slot, Matrix3d(-weighted));
    if (slot.from < 0 && slot.to >= 0)
      rhs.middleRows<3>(3 * slot.to) += weighted.transpose() * R[edge.from].transpose();
    if (slot.to < 0 && slot.from >= 0) rhs.middleRows<3>(3 * slot.from) += weighted * R[edge.to].transpose();
  }
  if (!cholesky.factorise()) return false;
  cholesky.solve(rhs);
  for (std::size_t i = 0; i < R.size(); ++i)
    if (s.variable[i] >= 0) R[i] = closest_rotation(rhs.middleRows<3>(3 * s.variable[i]).transpose());
  return true;
}

/// With rotations fixed the cost is quadratic in the translations: r_t = R_meas^T (R_i^T (t_j - t_i) - t_meas), r_theta
/// constant.
bool solve_translations(const PoseGraph& graph, const BlockStructure& s, BlockCholesky& cholesky,
                        const std::vector<Matrix3d>& R, std::vector<Pose3>& poses) {
  Eigen::MatrixXd rhs = Eigen::MatrixXd::Zero(3 * s.variables, 1);
  cholesky.set_zero();
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const auto& edge = graph.edges[e];
    if (edge.from == edge.to) continue;
    const auto& slot = s.edges[e];
    const Matrix3d R_meas = edge.T_from_to.rotation.toRotationMatrix();
    const Matrix3d to_world = R[edge.from] * R_meas;
    const Vector3d r_theta = so3_log(Eigen::Quaterniond(Matrix3d(to_world.transpose() * R[edge.to])));
    const Matrix3d W = to_world * edge.information.topLeftCorner<3, 3>() * to_world.transpose();
    Vector3d pull = W * (R[edge.from] * edge.T_from_to.translation) -
                    to_world * (edge.information.topRightCorner<3, 3>() * r_theta);
    if (slot.from < 0) pull += W * poses[edge.from].translation;
    if (slot.to < 0) pull -= W * poses[edge.to].translation;
    cholesky.add_edge(slot, Matrix3d(-W));
    if (slot.from >= 0) {
      cholesky.add_diagonal(slot.from, W);
      rhs.middleRows<3>(3 * slot.from) -= pull;
    }
    if (slot.to >= 0) {
      cholesky.add_diagonal(slot.to, W);
      rhs.middleRows<3>(3 * slot.to) += pull;
    }
  }
  if (!cholesky.factorise()) return false;
  cholesky.solve(rhs);
  for (std::size_t i = 0; i < poses.size(); ++i)
    if (s.variable[i] >= 0) poses[i] = {Eigen::Quaterniond(R[i]).normalized(), rhs.middleRows<3>(3 * s.variable[i])};
  return true;
}

}  // namespace

bool chordal(const PoseGraph& graph, const BlockStructure& structure, std::vector<Pose3>& poses) {
  std::vector<Matrix3d> R(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) R[i] = poses[i].rotation.toRotationMatrix();
  BlockCholesky cholesky(structure, 3);
  return solve_rotations(graph, structure, cholesky, R) && solve_translations(graph, structure, cholesky, R, poses);
}

}  // namespace tutti::estimation::internal
