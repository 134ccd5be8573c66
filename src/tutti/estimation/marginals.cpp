// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/marginals.hpp"

#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/estimation/internal/graph_equations.hpp"
#include "tutti/estimation/internal/posterior_samples.hpp"
#include "tutti/estimation/internal/selected_inverse.hpp"

namespace tutti::estimation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// L; nothing where the graph does not determine its poses.
std::optional<internal::CholeskyFactor> factor_of(const PoseGraph& graph, std::span<const Pose3> poses,
                                                  const internal::BlockStructure& structure,
                                                  std::span<const double> weights) {
  internal::GraphEquations equations(graph, structure);
  equations.linearise(poses, {.loss = {}, .roles = {}, .scale = weights}, true);
  if (!equations.hessian().factorise()) return std::nullopt;
  return equations.hessian().take_factor();
}

/// The edges of some components, over all nodes (those of the others are then alone), and their weights.
std::pair<PoseGraph, std::vector<double>> edges_of(const PoseGraph& graph, std::span<const double> weights,
                                                   const std::vector<bool>& components,
                                                   const internal::BlockStructure& structure) {
  std::pair<PoseGraph, std::vector<double>> out;
  out.first.poses = graph.poses;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    if (!components[static_cast<std::size_t>(structure.component[graph.edges[e].from])]) continue;
    out.first.edges.push_back(graph.edges[e]);
    if (!weights.empty()) out.second.push_back(weights[e]);
  }
  return out;
}

/// The components that are left, and their factor.
struct Sound {
  std::vector<bool> components;  ///< The others' poses are open.
  internal::BlockStructure structure;
  internal::CholeskyFactor factor;
};

/// Components are taken in turn as long as all together have a factor: what one lacks is not the others' fault.
Sound sound_components(const PoseGraph& graph, std::span<const Pose3> poses, std::span<const double> weights,
                       std::span<const JointPosterior::Pair> pairs, const internal::BlockStructure& structure) {
  std::vector<bool> none(static_cast<std::size_t>(structure.components), false);
  Sound out{.components = none, .structure = {}, .factor = {}};
  const auto factorise = [&](const std::vector<bool>& components, internal::BlockStructure& of) {
    const auto [part, part_weights] = edges_of(graph, weights, components, structure);
    of = internal::analyse_blocks(part, pairs);
    return factor_of(part, poses, of, part_weights);
  };
  if (auto factor = factorise(none, out.structure)) out.factor = std::move(*factor);
  for (std::size_t c = 0; c < none.size(); ++c) {
    std::vector<bool> with = out.components;
    with[c] = true;
    internal::BlockStructure of;
    auto factor = factorise(with, of);
    if (factor) out = {std::move(with), std::move(of), std::move(*factor)};
  }
  return out;
}

}  // namespace

struct JointPosterior::Factorised {
  internal::BlockStructure structure;
  std::vector<Pose3> poses;
  std::vector<Pair> pairs;
  std::vector<bool> determined;     ///< Per node.
  internal::CholeskyFactor factor;  ///< In elimination order.
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
  made->determined.assign(poses.size(), true);
  if (auto factor = factor_of(graph, poses, made->structure, weights)) {
    made->factor = std::move(*factor);
  } else {
    Sound sound = sound_components(graph, poses, weights, pairs, made->structure);
    for (std::size_t i = 0; i < poses.size(); ++i)
      made->determined[i] = sound.components[static_cast<std::size_t>(made->structure.component[i])];
    made->structure = std::move(sound.structure);
    made->factor = std::move(sound.factor);
  }
  factorised_ = std::move(made);
}

JointPosterior::~JointPosterior() = default;

std::vector<Matrix6d> JointPosterior::relative_covariances() const {
  const auto& [structure, poses, pairs, determined, factor] = *factorised_;
  std::vector<Matrix6d> out(pairs.size(), Matrix6d(Vector6d::Constant(kInfinity).asDiagonal()));
  const internal::SelectedInverse inverse(factor.copy());
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const auto [a, b] = pairs[k];
    if (!determined[a] || structure.component[a] != structure.component[b]) continue;
    if (a == b) {
      out[k].setZero();
      continue;
    }
    out[k] = inverse.relative(structure.variable[a], structure.variable[b], poses[b].inverse() * poses[a]);
  }
  return out;
}

std::vector<int> JointPosterior::variables_of(std::span<const std::size_t> nodes) const {
  const auto& structure = factorised_->structure;
  std::vector<int> out;
  for (const std::size_t node : nodes) {
    TUTTI_CHECK(node < structure.variable.size(), "node {} of {}", node, structure.variable.size());
    out.push_back(structure.variable[node]);
  }
  return out;
}

Eigen::MatrixXd JointPosterior::samples(std::span<const std::size_t> nodes, std::size_t count, Rng rng) const {
  Eigen::MatrixXd out = internal::posterior_samples(factorised_->factor, variables_of(nodes), count, rng);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (!factorised_->determined[nodes[k]]) out.middleRows<6>(static_cast<Eigen::Index>(6 * k)).setConstant(kInfinity);
  return out;
}

Eigen::MatrixXd JointPosterior::covariance(std::span<const std::size_t> nodes) const {
  Eigen::MatrixXd out = internal::posterior_covariance(factorised_->factor, variables_of(nodes));
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (!factorised_->determined[nodes[k]])
      out.diagonal().segment<6>(static_cast<Eigen::Index>(6 * k)).setConstant(kInfinity);
  return out;
}

}  // namespace tutti::estimation
