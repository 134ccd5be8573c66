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

}  // namespace tutti
