// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/agreement.hpp"

namespace tutti::evaluation {

std::optional<AteResult> agreement(const Trajectory& a, const Trajectory& b) {
  return ate(associate(a, b, {.interpolate = false, .max_difference_s = 0.0}));
}

}  // namespace tutti::evaluation
