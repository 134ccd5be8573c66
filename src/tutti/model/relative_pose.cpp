// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/relative_pose.hpp"

#include "tutti/geometry/symmetric.hpp"

namespace tutti {

RelativePose compound(const RelativePose& a_b, const RelativePose& b_c) {
  return {a_b.T_a_b * b_c.T_a_b, compound_covariance(b_c.T_a_b, a_b.covariance, b_c.covariance)};
}

RelativePose inverse(const RelativePose& a_b) {
  const Matrix6d Ad = adjoint(a_b.T_a_b);
  return {a_b.T_a_b.inverse(), Ad * a_b.covariance * Ad.transpose()};
}

double squared_distance(const RelativePose& one, const RelativePose& other) {
  const Vector6d missed = local(one.T_a_b, other.T_a_b);
  return squared_distance(missed, one.covariance + other.covariance);
}

}  // namespace tutti
