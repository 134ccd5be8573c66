// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/worst_sigma.hpp"

#include <cmath>

#include "tutti/geometry/symmetric.hpp"

namespace tutti::consistency::internal {

double worst_sigma(const Eigen::Matrix3d& scatter, double samples) {
  const Eigen::Matrix3d S = scatter / samples;
  const double trace = S.trace();
  if (!(trace > 0.0)) return 0.0;
  const double squares = S.squaredNorm();
  const double spread = (samples + 1.0 / 3.0) * (squares - trace * trace / 3.0);
  const double wanted = squares / 3.0 + trace * trace;
  const double share = wanted < spread ? wanted / spread : 1.0;
  const double largest = eigen_of(S).values(2);
  return std::sqrt((1.0 - share) * largest + share * trace / 3.0);
}

}  // namespace tutti::consistency::internal
