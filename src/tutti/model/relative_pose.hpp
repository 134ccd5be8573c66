// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/ids.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// Measured T_a_b with the covariance of its right perturbation [translation m; rotation rad] (see pose3.hpp, local()).
struct RelativePose {
  Pose3 T_a_b;
  Matrix6d covariance = Matrix6d::Identity();
  friend bool operator==(const RelativePose&, const RelativePose&) = default;
};

/// T_a_c with covariance, from independent measurements of its two parts; to first order.
RelativePose compound(const RelativePose& a_b, const RelativePose& b_c);

/// T_b_a with its covariance: (T Exp(xi))^-1 = T^-1 Exp(-Ad(T) xi), which carries the perturbation from frame b to a.
RelativePose inverse(const RelativePose& a_b);

/// Squared Mahalanobis distance between two independent measurements of one relative pose (6 degrees of freedom).
double squared_distance(const RelativePose& one, const RelativePose& other);

}  // namespace tutti
