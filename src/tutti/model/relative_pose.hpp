// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>

#include "tutti/base/ids.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// Measured T_a_b with the covariance of its right perturbation [translation m; rotation rad] (see pose3.hpp, local()).
struct RelativePose {
  Pose3 T_a_b;
  Matrix6d covariance = Matrix6d::Identity();
  friend bool operator==(const RelativePose&, const RelativePose&) = default;
};

/// T_a_c from independent measurements of its parts, to first order.
inline RelativePose compound(const RelativePose& a_b, const RelativePose& b_c) {
  return {a_b.T_a_b * b_c.T_a_b, compound_covariance(b_c.T_a_b, a_b.covariance, b_c.covariance)};
}

/// T_b_a: (T Exp(xi))^-1 = T^-1 Exp(-Ad(T) xi), so the perturbation moves from frame b to frame a.
inline RelativePose inverse(const RelativePose& a_b) {
  const Matrix6d Ad = adjoint(a_b.T_a_b);
  return {a_b.T_a_b.inverse(), Ad * a_b.covariance * Ad.transpose()};
}

/// Squared Mahalanobis distance of two independent ways to know one relative pose.
inline double squared_distance(const RelativePose& one, const RelativePose& other) {
  const Vector6d missed = local(one.T_a_b, other.T_a_b);
  return missed.dot((one.covariance + other.covariance).ldlt().solve(missed));
}

}  // namespace tutti
