// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/model/relative_pose.hpp"

namespace tutti {

/// Length of the path that these steps make, in metres.
inline double path_length_m(std::span<const RelativePose> steps) {
  double sum = 0.0;
  for (const RelativePose& step : steps) sum += step.T_a_b.translation.norm();
  return sum;
}

}  // namespace tutti
