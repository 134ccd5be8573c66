// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/chain_run.hpp"

#include <Eigen/Cholesky>
#include <vector>

#include "tutti/geometry/so3.hpp"

namespace tutti::estimation::internal {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// One step in the tangent of node a: rows of the map w -> zeta are M = [R1, [t]x R2; 0, R2], that is
/// Ad(C_k) diag(Exp(-r_theta), Jr(r_theta)).
struct StepMap {
  Matrix3d R1;
  Matrix3d R2;
  Vector3d t;

  [[nodiscard]] Vector6d apply(const Vector6d& w) const {
    Vector6d zeta;
    zeta.tail<3>() = R2 * w.tail<3>();
    zeta.head<3>() = R1 * w.head<3>() + t.cross(zeta.tail<3>());
    return zeta;
  }
  [[nodiscard]] Vector6d apply_transposed(const Vector6d& lambda) const {
    Vector6d out;
    out.head<3>() = R1.transpose() * lambda.head<3>();
    out.tail<3>() = R2.transpose() * (lambda.tail<3>() - t.cross(lambda.head<3>()));
    return out;
  }
  /// sum += M Q M^T, upper and lower.
  void add_covariance(const Matrix6d& Q, Matrix6d& sum) const {
    const Matrix3d T = skew(t);
    const Matrix3d A = R1 * Q.topLeftCorner<3, 3>() * R1.transpose();
    const Matrix3d B = R1 * Q.topRightCorner<3, 3>() * R2.transpose();
    const Matrix3d C = R2 * Q.bottomRightCorner<3, 3>() * R2.transpose();
    const Matrix3d TC = T * C;
    const Matrix3d BT = B * T;
    sum.topLeftCorner<3, 3>() += A - BT - BT.transpose() - TC * T;
    sum.topRightCorner<3, 3>() += B + TC;
    sum.bottomLeftCorner<3, 3>() += (B + TC).transpose();
    sum.bottomRightCorner<3, 3>() += C;
  }
};

/// One Newton step towards unit norm: enough for products of unit quaternions, and much cheaper than a root.
Eigen::Quaterniond nearly_unit(const Eigen::Quaterniond& q) {
  return Eigen::Quaterniond(q.coeffs() * (1.5 - 0.5 * q.squaredNorm()));
}

/// so3_exp, by its series where that has all digits: what a run is bent by is mostly less than a degree.
Eigen::Quaterniond small_exp(const Vector3d& theta) {
  const double x = 0.25 * theta.squaredNorm();  // (angle / 2)^2
  if (x > 1e-4) return so3_exp(theta);
  const double w = 1.0 - x * (1.0 / 2.0 - x * (1.0 / 24.0 - x / 720.0));
  const double k = 0.5 * (1.0 - x * (1.0 / 6.0 - x * (1.0 / 120.0 - x / 5040.0)));
  return {w, k * theta.x(), k * theta.y(), k * theta.z()};
}

/// Ad(C^-1) zeta.
Vector6d to_node(const Matrix3d& R, const Vector3d& t, const Vector6d& zeta) {
  Vector6d delta;
  delta.head<3>() = R.transpose() * (zeta.head<3>() - t.cross(zeta.tail<3>()));
  delta.tail<3>() = R.transpose() * zeta.tail<3>();
  return delta;
}

/// Linearised step: its map, and b_k already in the tangent of a.
struct LinearStep {
  StepMap map;
  Matrix3d R_a_k;
  Vector6d offset;
};

LinearStep linearise(const RelativePose& step, const Pose3& T_w_a, const Pose3& previous, const Pose3& current) {
  const Pose3& meas = step.T_a_b;
  const Eigen::Quaterniond q_a_w = T_w_a.rotation.conjugate();
  const Eigen::Quaterniond q_previous = previous.rotation.conjugate();
  const Vector3d r_t =
      meas.rotation.conjugate() * (q_previous * (current.translation - previous.translation) - meas.translation);
  const Vector3d r_theta = so3_log(meas.rotation.conjugate() * (q_previous * current.rotation));
  LinearStep out;
  out.R_a_k = (q_a_w * current.rotation).toRotationMatrix();
  out.map.R1 = (q_a_w * (previous.rotation * meas.rotation)).toRotationMatrix();  // R_a_k Exp(-r_theta)
  out.map.R2 = out.R_a_k * so3_right_jacobian(r_theta);
  out.map.t = q_a_w * (current.translation - T_w_a.translation);
  Vector6d r;
  r << r_t, r_theta;
  out.offset = -out.map.apply(r);
  return out;
}

}  // namespace

RunSum sum_odometry(std::span<const RelativePose> steps) {
  RunSum sum;
  for (const auto& step : steps) {
    sum.T_a_b = sum.T_a_b * step.T_a_b;
    const Matrix3d R = sum.T_a_b.rotation.toRotationMatrix();
    StepMap{R, R, sum.T_a_b.translation}.add_covariance(step.covariance, sum.covariance);
  }
  return sum;
}

RunSum sum_about(std::span<const RelativePose> steps, std::span<const Pose3> poses) {
  RunSum sum;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const LinearStep step = linearise(steps[k], poses.front(), poses[k], poses[k + 1]);
    step.map.add_covariance(steps[k].covariance, sum.covariance);
    sum.offset += step.offset;
  }
  sum.T_a_b = poses.front().inverse() * poses.back();
  return sum;
}

PoseGraphEdge as_edge(const RunSum& run, std::size_t from, std::size_t to) {
  // At b, the run's residual is delta_b - Ad(T_a_b^-1) delta_a = at_b. An edge measured as below has the residual J_b
  // times -at_b and J_a = -J_b Ad(T_a_b^-1), with J_b = diag(Exp(-at_b), Jr^-1(-at_b)) of the rotation's part.
  const Vector6d at_b = adjoint(run.T_a_b.inverse()) * run.offset;
  Matrix6d J_b_inverse = Matrix6d::Zero();
  J_b_inverse.topLeftCorner<3, 3>() = so3_exp(at_b.tail<3>()).toRotationMatrix();
  J_b_inverse.bottomRightCorner<3, 3>() = so3_right_jacobian(-at_b.tail<3>());
  Matrix6d whitened = adjoint(run.T_a_b) * J_b_inverse;
  run.covariance.llt().matrixL().solveInPlace(whitened);
  return {from, to, retract(run.T_a_b, at_b), whitened.transpose() * whitened};
}

void distribute_about(std::span<const RelativePose> steps, const RunSum& run, const Vector6d& delta_a,
                      const Vector6d& delta_b, std::span<Pose3> poses) {
  const Vector6d lambda = run.covariance.llt().solve(adjoint(run.T_a_b) * delta_b - delta_a - run.offset);
  const Pose3 T_w_a = poses.front();
  Pose3 previous = poses.front();
  Vector6d zeta = delta_a;
  for (std::size_t k = 0; k + 1 < steps.size(); ++k) {
    Pose3& pose = poses[k + 1];
    const LinearStep step = linearise(steps[k], T_w_a, previous, pose);
    zeta += step.offset + step.map.apply(steps[k].covariance * step.map.apply_transposed(lambda));
    previous = pose;
    pose = retract(pose, to_node(step.R_a_k, step.map.t, zeta));
  }
}

void distribute_odometry(std::span<const RelativePose> steps, const PoseGraphEdge& run, std::span<Pose3> poses) {
  const Pose3 T_w_a = poses.front();
  const Vector6d closing = local(T_w_a * run.T_from_to, poses.back());
  const Vector6d lambda = adjoint(run.T_from_to.inverse()).transpose() * (run.information * closing);
  const Matrix3d R_w_a = T_w_a.rotation.toRotationMatrix();
  const Vector3d lambda_t = lambda.head<3>();
  const Vector3d lambda_r = lambda.tail<3>();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();  // T_a_k
  Vector3d t = Vector3d::Zero();
  Vector3d zeta_t = Vector3d::Zero();
  Vector3d zeta_r = Vector3d::Zero();
  for (std::size_t k = 0; k + 1 < steps.size(); ++k) {
    const RelativePose& step = steps[k];
    t += q * step.T_a_b.translation;
    q = nearly_unit(q * step.T_a_b.rotation);
    const Matrix3d R = q.toRotationMatrix();
    Vector6d w;
    w << R.transpose() * lambda_t, R.transpose() * (lambda_r - t.cross(lambda_t));
    w = (step.covariance * w).eval();
    const Vector3d turned = R * w.tail<3>();
    zeta_t += R * w.head<3>() + t.cross(turned);
    zeta_r += turned;
    // retract(T_w_a T_a_k, Ad(T_a_k^-1) zeta), with R Exp(R^T v) = Exp(v) R
    poses[k + 1].rotation = (T_w_a.rotation * (small_exp(zeta_r) * q)).normalized();
    poses[k + 1].translation = T_w_a.translation + R_w_a * (t + zeta_t - t.cross(zeta_r));
  }
}

Eigen::MatrixXd spread_about(std::span<const RelativePose> steps, std::span<const Pose3> poses,
                             const Eigen::Ref<const Eigen::MatrixXd>& deltas_a,
                             const Eigen::Ref<const Eigen::MatrixXd>& deltas_b) {
  std::vector<Matrix6d> up_to{Matrix6d::Zero()};  // covariance of zeta_k
  std::vector<Matrix6d> to_nodes;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    linearise(steps[k], poses.front(), poses[k], poses[k + 1])
        .map.add_covariance(steps[k].covariance, up_to.emplace_back(up_to.back()));
    to_nodes.push_back(adjoint(poses[k + 1].inverse() * poses.front()));
  }
  const Eigen::MatrixXd lambda =
      up_to.back().llt().solve(adjoint(poses.front().inverse() * poses.back()) * deltas_b - deltas_a);
  Eigen::MatrixXd out(6 * (static_cast<Eigen::Index>(steps.size()) - 1), deltas_a.cols());
  for (std::size_t k = 0; k + 1 < steps.size(); ++k)
    out.middleRows<6>(static_cast<Eigen::Index>(6 * k)) = to_nodes[k] * (deltas_a + up_to[k + 1] * lambda);
  return out;
}

}  // namespace tutti::estimation::internal
