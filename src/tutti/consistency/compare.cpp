// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/compare.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "tutti/consistency/signal.hpp"
#include "tutti/spectral/graph.hpp"
#include "tutti/spectral/kron.hpp"
#include "tutti/spectral/meyer.hpp"
#include "tutti/spectral/spectrum.hpp"
#include "tutti/spectral/wavelet_transform.hpp"

namespace tutti::consistency {
namespace {

using spectral::SparseMatrix;

SparseMatrix proximity_laplacian(const std::vector<Eigen::Vector3d>& positions, const ProxyGraph& rule) {
  const SparseMatrix A = spectral::proximity_adjacency(positions, rule.radius_m, rule.sigma_m);  // eq. (1)
  return spectral::laplacian(A);                                                                 // eq. (2)
}

/// The carried edges between synchronised nodes, numbered by pair.
std::vector<spectral::WeightedEdge> carried_edges(const ProxyGraph& graph, const std::vector<NodePair>& pairs) {
  std::vector<int> pair_of(graph.nodes.size(), -1);
  for (std::size_t i = 0; i < pairs.size(); ++i) pair_of[pairs[i].proxy] = static_cast<int>(i);
  std::vector<spectral::WeightedEdge> edges;
  for (const ProxyEdge& edge : graph.edges)
    if (pair_of[edge.a] >= 0 && pair_of[edge.b] >= 0) edges.push_back({pair_of[edge.a], pair_of[edge.b], edge.weight});
  return edges;
}

/// The robot's graph over kept and eliminated nodes, reduced to the kept ones (eq. 3); of the reduced edges those that
/// the server kept.
SparseMatrix reduced_laplacian(const ProxyGraph& graph, std::span<const RobotNode> nodes, const Synchronisation& sync,
                               std::vector<spectral::WeightedEdge> pattern) {
  std::vector<Eigen::Vector3d> positions;
  std::vector<int> keep;
  for (const NodePair& pair : sync.pairs) {
    keep.push_back(static_cast<int>(positions.size()));
    positions.push_back(nodes[pair.robot].T_map_body.translation);
  }
  for (const std::size_t i : sync.eliminated) positions.push_back(nodes[i].T_map_body.translation);
  const SparseMatrix reduced = spectral::kron_reduce(proximity_laplacian(positions, graph), keep).laplacian;
  for (auto& edge : pattern) edge.weight = -reduced.coeff(edge.a, edge.b);
  std::erase_if(pattern, [](const auto& edge) { return !(edge.weight > 0.0); });
  return spectral::laplacian(spectral::adjacency_from_edges(static_cast<int>(keep.size()), pattern));
}

/// W(n, s * d + c) = psi_{s,n}^T f_c, eq. (7) and below.
Eigen::MatrixXd transform(const GraphSignal& of, const spectral::MeyerFilterBank& bank, const CompareConfig& config,
                          int& order) {
  if (config.exact) return spectral::exact_transform(spectral::dense_spectrum(of.laplacian), bank, of.signal);
  // Half of the tolerance for either side, spread over the columns that eq. (8) sums in squares.
  const double tolerance = config.tolerance_m / (2.0 * std::sqrt(static_cast<double>(of.signal.cols())));
  auto result = spectral::chebyshev_transform(of.laplacian, bank, of.signal,
                                              {.tolerance = tolerance, .largest_eigenvalue = of.largest_eigenvalue});
  order = std::max(order, result.order);
  return std::move(result.coefficients);
}

}  // namespace

Eigen::MatrixXd disagreement(const GraphSignal& server, const GraphSignal& robot, const CompareConfig& config,
                             int& order) {
  const spectral::MeyerFilterBank bank(config.scales, std::max(server.largest_eigenvalue, robot.largest_eigenvalue));
  order = 0;
  const Eigen::MatrixXd difference = transform(server, bank, config, order) - transform(robot, bank, config, order);
  Eigen::MatrixXd d(difference.rows(), config.scales);
  for (int s = 0; s < config.scales; ++s)
    d.col(s) = difference.middleCols(s * server.signal.cols(), server.signal.cols()).rowwise().norm();  // eq. (8)
  return d;
}

Comparison compare(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                   const CompareConfig& config) {
  const Synchronisation sync = synchronise(graph, chain, nodes);
  Comparison out{.pairs = sync.pairs, .disagreement = {}};
  out.disagreement = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(sync.pairs.size()), config.scales);
  if (sync.pairs.size() < 2) return out;

  std::vector<Pose3> poses_server, poses_robot;
  std::vector<Eigen::Vector3d> positions_server, positions_robot;
  for (const NodePair& pair : sync.pairs) {
    poses_server.push_back(graph.nodes[pair.proxy].T_world_body);
    poses_robot.push_back(nodes[pair.robot].T_map_body);
    positions_server.push_back(poses_server.back().translation);
    positions_robot.push_back(poses_robot.back().translation);
  }

  SparseMatrix L_server, L_robot;
  if (graph.reduced) {
    const auto edges = carried_edges(graph, sync.pairs);
    L_server = spectral::laplacian(spectral::adjacency_from_edges(static_cast<int>(sync.pairs.size()), edges));
    L_robot = reduced_laplacian(graph, nodes, sync, edges);
  } else {
    L_server = proximity_laplacian(positions_server, graph);
    L_robot = proximity_laplacian(positions_robot, graph);
  }
  const auto largest = [](const SparseMatrix& L) {
    return spectral::largest_eigenvalue(L, spectral::kLargestEigenvalueTolerance);
  };
  const Eigen::MatrixXd f_server = evaluate_signal(config.signal, poses_server),
                        f_robot = evaluate_signal(config.signal, poses_robot);
  const GraphSignal server{L_server, f_server, largest(L_server)}, robot{L_robot, f_robot, largest(L_robot)};
  out.lambda_max = std::max(server.largest_eigenvalue, robot.largest_eigenvalue);
  out.disagreement = disagreement(server, robot, config, out.order);
  return out;
}

}  // namespace tutti::consistency
