// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/path_scale.hpp"

#include <cmath>

namespace tutti::bundle {

PathScale path_scale(const std::vector<ComparedStep>& steps, const BundleSolution& solution,
                     const Posterior& posterior) {
  double square_m2 = 0.0, product_m2 = 0.0;
  std::vector<std::pair<std::size_t, Vector6d>> gradient;
  for (const ComparedStep& step : steps) {
    const Pose3 T_from_to = solution.T_world_body[step.from].inverse() * solution.T_world_body[step.to];
    square_m2 += step.weight * step.expected.squaredNorm();
    product_m2 += step.weight * step.expected.dot(T_from_to.translation);
    Vector6d by_step = Vector6d::Zero();  // a step's translation moves by R_from_to rho
    by_step.head<3>() = step.weight * (T_from_to.rotation.conjugate() * step.expected);
    gradient.emplace_back(step.to, by_step);  // delta_from_to = delta_to - Ad(T_from_to^-1) delta_from
    gradient.emplace_back(step.from, -adjoint(T_from_to.inverse()).transpose() * by_step);
  }
  if (!(square_m2 > 0.0)) return {};
  return {product_m2 / square_m2, posterior.variance_of(gradient) / (square_m2 * square_m2), std::sqrt(square_m2)};
}

}  // namespace tutti::bundle
