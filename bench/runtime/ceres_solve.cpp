// SPDX-License-Identifier: BSD-3-Clause
#include "ceres_solve.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>

#include "tutti/geometry/symmetric.hpp"

namespace tutti::bench {
namespace {

template <class T>
using Quaternion = Eigen::Quaternion<T>;
template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

/// r = [R_meas^T (t_ij - t_meas); Log(R_meas^T R_ij)], whitened; poses are [tx ty tz qx qy qz qw].
struct BetweenCost {
  Pose3 meas;
  Matrix6d root;  ///< root^T root = information
  template <class T>
  bool operator()(const T* t_i, const T* q_i, const T* t_j, const T* q_j, T* residual) const {
    const Quaternion<T> to_i = Eigen::Map<const Quaternion<T>>(q_i).conjugate();
    const Quaternion<T> to_meas = meas.rotation.conjugate().template cast<T>();
    Eigen::Matrix<T, 6, 1> r;
    r.template head<3>() = to_meas * (to_i * (Eigen::Map<const Vector3<T>>(t_j) - Eigen::Map<const Vector3<T>>(t_i)) -
                                      meas.translation.template cast<T>());
    const Quaternion<T> q = to_meas * (to_i * Eigen::Map<const Quaternion<T>>(q_j));
    const std::array<T, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
    ceres::QuaternionToAngleAxis(wxyz.data(), r.data() + 3);
    Eigen::Map<Eigen::Matrix<T, 6, 1>> whitened(residual);
    whitened = root.template cast<T>() * r;
    return true;
  }
};

}  // namespace

std::vector<Pose3> solve_with_ceres(const PoseGraph& graph) {
  std::vector<Pose3> poses = graph.poses;
  ceres::Problem problem;
  auto* manifold = new ceres::EigenQuaternionManifold;  // owned by the problem
  for (Pose3& pose : poses) {
    problem.AddParameterBlock(pose.translation.data(), 3);
    problem.AddParameterBlock(pose.rotation.coeffs().data(), 4, manifold);
  }
  problem.SetParameterBlockConstant(poses[0].translation.data());
  problem.SetParameterBlockConstant(poses[0].rotation.coeffs().data());
  for (const auto& edge : graph.edges) {
    const Matrix6d root = root_of_information(edge.information);
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<BetweenCost, 6, 3, 4, 3, 4>(new BetweenCost{edge.T_from_to, root}), nullptr,
        poses[edge.from].translation.data(), poses[edge.from].rotation.coeffs().data(),
        poses[edge.to].translation.data(), poses[edge.to].rotation.coeffs().data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.initial_trust_region_radius = 1e12;
  options.max_num_iterations = 30;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  for (Pose3& pose : poses) pose.rotation.normalize();
  return poses;
}

}  // namespace tutti::bench
