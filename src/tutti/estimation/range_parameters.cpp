// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/range_parameters.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

#include "tutti/base/check.hpp"
#include "tutti/estimation/internal/graph_equations.hpp"

namespace tutti::estimation {
namespace {

/// In its unit, what each parameter's sigma is where ranges say nothing of it.
constexpr double kUnknownParameter = 1e3;
/// So many are solved for at a time, which bounds the memory.
constexpr Eigen::Index kParametersAtOnce = 16;

using Sparse = Eigen::SparseMatrix<double>;
using Entries = std::vector<Eigen::Triplet<double>>;

Sparse matrix_of(Eigen::Index rows, Eigen::Index columns, const Entries& entries) {
  Sparse out(rows, columns);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

/// The ranges' Jacobian, whitened, its columns in elimination order.
Sparse jacobian(const PoseGraph& graph, const internal::BlockStructure& structure, std::span<const GraphRange> ranges,
                const Eigen::VectorXd& whitening, Eigen::VectorXd& residuals) {
  Entries entries;
  for (int k = 0; k < std::ssize(ranges); ++k) {
    const GraphRange& of = ranges[static_cast<std::size_t>(k)];
    const auto at = linearise_range(graph.poses[of.from], graph.poses[of.to], of.range);
    residuals(k) = whitening(k) * at.residual;
    for (const auto& [node, J] : {std::pair(of.from, at.J_i), std::pair(of.to, at.J_j)})
      if (const int v = structure.variable[node]; v >= 0)
        for (int i = 0; i < 6; ++i) entries.emplace_back(k, 6 * v + i, whitening(k) * J(i));
  }
  return matrix_of(std::ssize(ranges), 6 * structure.variables, entries);
}

}  // namespace

std::vector<ParameterEstimate> missing_parameters(const PoseGraph& graph, std::span<const double> weights,
                                                  std::span<const GraphRange> ranges,
                                                  std::span<const RangeParameter> parameters) {
  TUTTI_CHECK(weights.size() == graph.edges.size() && ranges.size() <= graph.edges.size(),
              "{} weights, {} edges, {} ranges", weights.size(), graph.edges.size(), ranges.size());
  const auto structure = internal::analyse_blocks(graph);
  internal::GraphEquations equations(graph, structure);
  equations.linearise(graph.poses, {.loss = {}, .roles = {}, .scale = weights}, true);
  if (parameters.empty() || structure.variables == 0 || !equations.factorise()) return {};

  Eigen::VectorXd whitening(std::ssize(ranges)), residuals(std::ssize(ranges));
  for (std::size_t k = 0; k < ranges.size(); ++k)
    whitening(static_cast<Eigen::Index>(k)) =
        std::sqrt(weights[weights.size() - ranges.size() + k]) / ranges[k].sigma_m;
  const Sparse J = jacobian(graph, structure, ranges, whitening, residuals);
  Entries entries;
  for (int p = 0; p < std::ssize(parameters); ++p)
    for (const auto& [k, per_unit] : parameters[static_cast<std::size_t>(p)])
      entries.emplace_back(static_cast<int>(k), p, whitening(static_cast<Eigen::Index>(k)) * per_unit);
  const Sparse X = matrix_of(std::ssize(ranges), std::ssize(parameters), entries), B = J.transpose() * X;

  Eigen::MatrixXd known = Eigen::MatrixXd(Sparse(X.transpose() * X));
  for (Eigen::Index first = 0; first < X.cols(); first += kParametersAtOnce) {
    const Eigen::Index count = std::min(kParametersAtOnce, X.cols() - first);
    Eigen::MatrixXd moved = B.middleCols(first, count);
    equations.hessian().solve(moved);
    known.middleCols(first, count) -= B.transpose() * moved;
  }
  known.diagonal().array() += 1.0 / (kUnknownParameter * kUnknownParameter);
  const Eigen::MatrixXd covariance = known.ldlt().solve(Eigen::MatrixXd::Identity(X.cols(), X.cols()));
  const Eigen::VectorXd values = -covariance * (X.transpose() * residuals);
  std::vector<ParameterEstimate> out;
  for (Eigen::Index p = 0; p < X.cols(); ++p) out.push_back({values(p), std::sqrt(std::max(0.0, covariance(p, p)))});
  return out;
}

}  // namespace tutti::estimation
