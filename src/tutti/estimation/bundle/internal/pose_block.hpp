// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/geometry/pose3.hpp"

/// A pose as a solver's parameter block [tx ty tz qx qy qz qw] with retract() and local() of geometry/pose3.hpp.
namespace tutti::bundle::internal {

using PlusJacobian = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;
using MinusJacobian = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;

Pose3 pose_of(const double* block);
void write_pose(const Pose3& pose, double* block);

/// d retract(x, delta) / d delta at delta = 0, and d local(x, y) / d y at y = x; the second times the first is the
/// identity.
PlusJacobian plus_jacobian(const double* x);
MinusJacobian minus_jacobian(const double* x);

}  // namespace tutti::bundle::internal
