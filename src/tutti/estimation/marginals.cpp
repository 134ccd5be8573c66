// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/marginals.hpp"

#include <limits>

#include "tutti/base/check.hpp"
#include "tutti/estimation/internal/gauss_newton.hpp"
#include "tutti/estimation/internal/selected_inverse.hpp"

namespace tutti::estimation {
namespace {

Matrix6d unknown() { return Matrix6d(Vector6d::Constant(std::numeric_limits<double>::infinity()).asDiagonal()); }

}  // namespace

std::vector<Matrix6d> relative_covariances(const PoseGraph& graph, std::span<const Pose3> poses,
                                           std::span<const std::pair<std::size_t, std::size_t>> pairs,
                                           std::span<const double> weights) {
  TUTTI_CHECK(poses.size() == graph.poses.size(), "{} poses, {} nodes", poses.size(), graph.poses.size());
  TUTTI_CHECK(weights.empty() || weights.size() == graph.edges.size(), "{} weights, {} edges", weights.size(),
              graph.edges.size());
  std::vector<Matrix6d> out(pairs.size(), unknown());
  const auto structure = internal::analyse_blocks(graph, pairs);
  internal::GaussNewton gauss_newton(graph, structure);
  gauss_newton.linearise(poses, {.loss = {}, .roles = {}, .scale = weights}, true);
  if (!gauss_newton.hessian().factorise()) return out;
  const internal::SelectedInverse inverse(gauss_newton.hessian().take_factor());

  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [a, b] = pairs[k];
    if (structure.component[a] != structure.component[b]) continue;
    if (a == b) {
      out[k].setZero();
      continue;
    }
    const int u = structure.variable[a];
    const int v = structure.variable[b];
    // delta_a_b = delta_b - Ad(T_a_b^-1) delta_a; anchored poses do not move.
    const Matrix6d A = adjoint(poses[b].inverse() * poses[a]);
    Matrix6d covariance = Matrix6d::Zero();
    if (v >= 0) covariance += inverse.block(v, v);
    if (u >= 0) covariance += A * inverse.block(u, u) * A.transpose();
    if (u >= 0 && v >= 0) {
      const Matrix6d cross = A * inverse.block(u, v);
      covariance -= cross + cross.transpose();
    }
    out[k] = 0.5 * (covariance + covariance.transpose());
  }
  return out;
}

}  // namespace tutti::estimation
