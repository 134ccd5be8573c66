// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/range_factor.hpp"

#include "tutti/geometry/so3.hpp"

namespace tutti::estimation {
namespace {

/// Nearer points count as one.
constexpr double kCoincide_m = 1e-6;

}  // namespace

RangeLinearisation linearise_range(const Pose3& T_w_i, const Pose3& T_w_j, const Range& range) {
  const Pose3 T_i_j = T_w_i.inverse() * T_w_j;
  const Eigen::Vector3d q = T_i_j * range.p_j, apart = q - range.p_i;
  const double distance = apart.norm();
  const Eigen::Vector3d u = distance < kCoincide_m ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : apart / distance;
  const Eigen::RowVector3d along_j = u.transpose() * T_i_j.rotation.toRotationMatrix();
  RangeLinearisation out;
  out.residual = distance - range.distance_m;
  out.J_i << -u.transpose(), u.transpose() * skew(q);
  out.J_j << along_j, -along_j * skew(range.p_j);
  return out;
}

PoseGraphEdge range_edge(std::size_t i, std::size_t j, const Pose3& T_w_i, const Pose3& T_w_j, const Range& range,
                         double sigma_m) {
  const RangeLinearisation at = linearise_range(T_w_i, T_w_j, range);
  PoseGraphEdge out{.from = i,
                    .to = j,
                    .T_from_to = T_w_i.inverse() * T_w_j,
                    .information = at.J_j.transpose() * at.J_j / (sigma_m * sigma_m)};
  // The edge's own residual at these poses is then the range's along J_j, which is a unit vector in translation.
  const Eigen::Vector3d along_j = at.J_j.head<3>().transpose();
  out.T_from_to.translation -= at.residual * (out.T_from_to.rotation * along_j);
  return out;
}

}  // namespace tutti::estimation
