// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>

#include "tutti/geometry/pose3.hpp"

namespace tutti::server {

/// What poses are off by, in the axes of `world`: (3 poses) x columns, one column per sample or shift.
struct Displacements {
  /// `tangents`: (6 poses) x columns, right tangents; without columns, of any height.
  Displacements(std::span<const Pose3> poses, const Eigen::Ref<const Eigen::MatrixXd>& tangents);

  Eigen::MatrixXd position_m;
  Eigen::MatrixXd rotation_rad;
};

}  // namespace tutti::server
