// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/marginals.hpp"

#include <limits>

#include "tutti/base/check.hpp"
#include "tutti/estimation/internal/graph_equations.hpp"
#include "tutti/estimation/internal/posterior_samples.hpp"
#include "tutti/estimation/internal/selected_inverse.hpp"

namespace tutti::estimation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

struct JointPosterior::Factorised {
  internal::BlockStructure structure;
  std::vector<Pose3> poses;
  std::vector<Pair> pairs;
  bool determined = false;
  internal::BlockCholesky::Columns factor;  ///< L, in elimination order.
};

JointPosterior::JointPosterior(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const Pair> pairs,
                               std::span<const double> weights) {
  TUTTI_CHECK(poses.size() == graph.poses.size(), "{} poses, {} nodes", poses.size(), graph.poses.size());
  TUTTI_CHECK(weights.empty() || weights.size() == graph.edges.size(), "{} weights, {} edges", weights.size(),
              graph.edges.size());
  auto made = std::make_unique<Factorised>();
  made->structure = internal::analyse_blocks(graph, pairs);
  made->poses.assign(poses.begin(), poses.end());
  made->pairs.assign(pairs.begin(), pairs.end());
  internal::GraphEquations equations(graph, made->structure);
  equations.linearise(poses, {.loss = {}, .roles = {}, .scale = weights}, true);
  if (equations.hessian().factorise()) made->factor = equations.hessian().factor();
  made->determined = made->factor.start.size() == static_cast<std::size_t>(6 * made->structure.variables + 1);
  factorised_ = std::move(made);
}

JointPosterior::~JointPosterior() = default;

std::vector<Matrix6d> JointPosterior::relative_covariances() const {
  const auto& [structure, poses, pairs, determined, factor] = *factorised_;
  std::vector<Matrix6d> out(pairs.size(), Matrix6d(Vector6d::Constant(kInfinity).asDiagonal()));
  if (!determined) return out;
  const internal::SelectedInverse inverse(factor);
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

Eigen::MatrixXd JointPosterior::samples(std::span<const std::size_t> nodes, std::size_t count, Rng rng) const {
  const auto& structure = factorised_->structure;
  std::vector<int> variables;
  for (const std::size_t node : nodes) {
    TUTTI_CHECK(node < structure.variable.size(), "node {} of {}", node, structure.variable.size());
    variables.push_back(structure.variable[node]);
  }
  if (!factorised_->determined)
    return Eigen::MatrixXd::Constant(static_cast<Eigen::Index>(6 * nodes.size()), static_cast<Eigen::Index>(count),
                                     kInfinity);
  return internal::posterior_samples(factorised_->factor, variables, count, rng);
}

std::vector<Matrix6d> relative_covariances(const PoseGraph& graph, std::span<const Pose3> poses,
                                           std::span<const std::pair<std::size_t, std::size_t>> pairs,
                                           std::span<const double> weights) {
  return JointPosterior(graph, poses, pairs, weights).relative_covariances();
}

}  // namespace tutti::estimation
