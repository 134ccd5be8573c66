// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/odometry_error.hpp"

#include <Eigen/Cholesky>
#include <algorithm>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::consistency::internal {
namespace {

Eigen::Matrix<double, 3, 6> lever(const Eigen::Vector3d& x) {
  Eigen::Matrix<double, 3, 6> J;
  J << Eigen::Matrix3d::Identity(), -skew(x);
  return J;
}

}  // namespace

OdometryError::OdometryError(std::span<const Pose3> server, std::span<const RelativePose> odometry, double lever_m)
    : lever_m_(lever_m) {
  TUTTI_CHECK(server.size() == odometry.size(), "{} poses, {} steps", server.size(), odometry.size());
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  for (const Pose3& T : server) centroid += T.translation / static_cast<double>(server.size());
  nodes_.resize(server.size());
  Sums sums;
  for (std::size_t k = 0; k < server.size(); ++k) {
    Node& node = nodes_[k];
    const Pose3 T{server[k].rotation, server[k].translation - centroid};
    node.x = T.translation;
    if (k > 0) {
      const Pose3 T_before{server[k - 1].rotation, server[k - 1].translation - centroid};
      // T_before odometry = exp(e) T: what the step is off by, as a motion of space.
      const Pose3 off = T_before * odometry[k].T_a_b * T.inverse();
      Vector6d e;
      e << off.translation, so3_log(off.rotation);
      const Matrix6d Ad = adjoint(T);
      node.E = nodes_[k - 1].E + e;
      node.C = nodes_[k - 1].C + Ad * odometry[k].covariance * Ad.transpose();
    }
    const Matrix6d M = metric_of(k);
    const Vector6d ME = M * node.E;
    const Matrix6d CM = node.C * M;
    sums.EME += node.E.dot(ME);
    sums.ME += ME;
    sums.CME += node.C * ME;
    sums.M += M;
    sums.CM += CM;
    sums.CMC += CM * node.C;
    node.sums = sums;
  }
}

Matrix6d OdometryError::metric_of(std::size_t k) const {
  const Eigen::Matrix<double, 3, 6> J = lever(nodes_[k].x);
  Matrix6d M = J.transpose() * J;
  M.diagonal().tail<3>().array() += lever_m_ * lever_m_;
  return M;
}

OdometryError::Sums OdometryError::sums_over(std::size_t first, std::size_t last) const {
  Sums out = nodes_[last].sums;
  if (first == 0) return out;
  const Sums& before = nodes_[first - 1].sums;
  out.EME -= before.EME;
  out.ME -= before.ME;
  out.CME -= before.CME;
  out.M -= before.M;
  out.CM -= before.CM;
  out.CMC -= before.CMC;
  return out;
}

// All errors are E_k - C_k G - h.
double OdometryError::bridged(std::size_t a, std::size_t b) const {
  if (b < a + 2) return 0.0;
  const Vector6d G = (nodes_[b].C - nodes_[a].C).ldlt().solve(nodes_[b].E - nodes_[a].E);
  if (b - a <= kNodeByNode) {
    double sum = 0.0;
    for (std::size_t k = a + 1; k < b; ++k) {
      const Vector6d rho = nodes_[k].E - nodes_[a].E - (nodes_[k].C - nodes_[a].C) * G;
      sum += (lever(nodes_[k].x) * rho).squaredNorm() + lever_m_ * lever_m_ * rho.tail<3>().squaredNorm();
    }
    return sum;
  }
  const Sums over = sums_over(a + 1, b - 1);
  const Vector6d h = nodes_[a].E - nodes_[a].C * G;
  const double sum = over.EME + G.dot(over.CMC * G) + h.dot(over.M * h) - 2.0 * G.dot(over.CME) - 2.0 * h.dot(over.ME) +
                     2.0 * G.dot(over.CM * h);
  return std::max(0.0, sum);
}

double OdometryError::hanging(std::size_t held, std::size_t first, std::size_t last) const {
  const Sums over = sums_over(first, last);
  const Vector6d& h = nodes_[held].E;
  return std::max(0.0, over.EME + h.dot(over.M * h) - 2.0 * h.dot(over.ME));
}

// With E, C counted from node a and offsets a, b of the ends: rho_k = a + E_k - C_k L (E_b - b + a), L = C_b^-1.
OdometryError::Quadratic OdometryError::between(std::size_t a, std::size_t b) const {
  using Matrix6x12d = Eigen::Matrix<double, 6, 12>;
  const Matrix6d L = (nodes_[b].C - nodes_[a].C).ldlt().solve(Matrix6d::Identity());
  const Vector6d G = L * (nodes_[b].E - nodes_[a].E);
  Eigen::Matrix<double, 12, 12> Q = Eigen::Matrix<double, 12, 12>::Zero();
  Eigen::Matrix<double, 12, 1> q = Eigen::Matrix<double, 12, 1>::Zero();
  Quadratic out;
  for (std::size_t k = a + 1; k <= b; ++k) {
    const Matrix6d C = nodes_[k].C - nodes_[a].C;
    const Vector6d rho = nodes_[k].E - nodes_[a].E - C * G;
    const Matrix6d by_b = C * L;
    Matrix6x12d by;  // d rho / d(a, b)
    by << Matrix6d::Identity() - by_b, by_b;
    const Matrix6d M = metric_of(k);
    const Vector6d M_rho = M * rho;
    out.constant += rho.dot(M_rho);
    q -= by.transpose() * M_rho;
    Q += by.transpose() * (M * by);
  }
  out.right_a = q.head<6>();
  out.right_b = q.tail<6>();
  out.aa = Q.topLeftCorner<6, 6>();
  out.ab = Q.topRightCorner<6, 6>();
  out.bb = Q.bottomRightCorner<6, 6>();
  return out;
}

OdometryError::Fit OdometryError::fit(std::span<const std::size_t> held) const {
  TUTTI_CHECK(!held.empty(), "no node is held");
  const std::size_t n = held.size();
  std::vector<Matrix6d> diagonal(n, Matrix6d::Zero()), above(n, Matrix6d::Zero());  // above[j]: block (j, j + 1)
  std::vector<Vector6d> right(n, Vector6d::Zero());
  double constant = 0.0;
  const auto hang = [&](std::size_t j, std::size_t first, std::size_t last) {
    const Sums over = sums_over(first, last);
    const Vector6d& h = nodes_[held[j]].E;
    diagonal[j] += over.M;
    right[j] -= over.ME - over.M * h;
    constant += over.EME + h.dot(over.M * h) - 2.0 * h.dot(over.ME);
  };
  hang(0, 0, held.front());
  for (std::size_t j = 0; j + 1 < n; ++j) {
    const Quadratic run = between(held[j], held[j + 1]);
    constant += run.constant;
    right[j] += run.right_a;
    right[j + 1] += run.right_b;
    diagonal[j] += run.aa;
    above[j] = run.ab;
    diagonal[j + 1] += run.bb;
  }
  if (held.back() + 1 < size()) hang(n - 1, held.back() + 1, size() - 1);

  // Joints close to each other would be turned freely: each counts as one node more that is where the server has it.
  for (std::size_t j = 0; j < n; ++j) diagonal[j] += metric_of(held[j]);

  const std::vector<Vector6d> gradient = right;
  for (std::size_t j = 0; j + 1 < n; ++j) {  // block Cholesky
    const Matrix6d lower = diagonal[j].ldlt().solve(above[j]).transpose();
    diagonal[j + 1] -= lower * above[j];
    right[j + 1] -= lower * right[j];
  }
  Fit out{.offsets = std::vector<Vector6d>(n), .squared_error = constant};
  for (std::size_t j = n; j-- > 0;) {
    if (j + 1 < n) right[j] -= above[j] * out.offsets[j + 1];
    out.offsets[j] = diagonal[j].ldlt().solve(right[j]);
    out.squared_error -= gradient[j].dot(out.offsets[j]);
  }
  out.squared_error = std::max(0.0, out.squared_error);
  return out;
}

Eigen::MatrixXd OdometryError::residual(std::span<const std::size_t> held, std::span<const Vector6d> offsets) const {
  TUTTI_CHECK(!held.empty() && (offsets.empty() || offsets.size() == held.size()), "{} nodes held, {} offsets",
              held.size(), offsets.size());
  const auto offset = [&](std::size_t j) -> Vector6d { return offsets.empty() ? Vector6d::Zero() : offsets[j]; };
  Eigen::MatrixXd out(static_cast<Eigen::Index>(size()), 6);
  const auto write = [&](std::size_t k, const Vector6d& rho) {
    out.row(static_cast<Eigen::Index>(k)) = at_node(k, rho).transpose();
  };
  for (std::size_t k = 0; k <= held.front(); ++k) write(k, nodes_[k].E - nodes_[held.front()].E + offset(0));
  for (std::size_t j = 1; j < held.size(); ++j) {
    const Node& a = nodes_[held[j - 1]];
    const Node& b = nodes_[held[j]];
    const Vector6d G = (b.C - a.C).ldlt().solve(b.E - a.E - offset(j) + offset(j - 1));
    for (std::size_t k = held[j - 1] + 1; k <= held[j]; ++k)
      write(k, offset(j - 1) + nodes_[k].E - a.E - (nodes_[k].C - a.C) * G);
  }
  const std::size_t last = held.size() - 1;
  for (std::size_t k = held.back() + 1; k < size(); ++k) write(k, nodes_[k].E - nodes_[held.back()].E + offset(last));
  return out;
}

Vector6d OdometryError::at_node(std::size_t node, const Vector6d& offset) const {
  Vector6d out;
  out << lever(nodes_[node].x) * offset, offset.tail<3>();
  return out;
}

Vector6d OdometryError::missed(std::size_t a, std::size_t b) const { return at_node(b, nodes_[b].E - nodes_[a].E); }

Matrix6d OdometryError::missed_covariance(std::size_t a, std::size_t b) const {
  Matrix6d A = Matrix6d::Identity();
  A.topRows<3>() = lever(nodes_[b].x);
  return A * (nodes_[b].C - nodes_[a].C) * A.transpose();
}

}  // namespace tutti::consistency::internal
