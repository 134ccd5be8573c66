// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/displacements.hpp"

namespace tutti::server {

Displacements::Displacements(std::span<const Pose3> poses, const Eigen::Ref<const Eigen::MatrixXd>& tangents)
    : position_m(3 * static_cast<Eigen::Index>(poses.size()), tangents.cols()), rotation_rad(position_m) {
  if (tangents.cols() == 0) return;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const Eigen::Matrix3d R = poses[k].rotation.toRotationMatrix();
    const auto row = static_cast<Eigen::Index>(k);
    position_m.middleRows<3>(3 * row) = R * tangents.middleRows<3>(6 * row);
    rotation_rad.middleRows<3>(3 * row) = R * tangents.middleRows<3>(6 * row + 3);
  }
}

}  // namespace tutti::server
