// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "tutti/model/proxy_graph.hpp"

namespace tutti::consistency {

/// What the map knows of the n nodes of one chain in a proxy graph, to first order. All rows are right tangents, six
/// for each node.
struct ChainKnowledge {
  /// (6 n) x samples: joint draws of what the nodes are off by, zero mean.
  Eigen::MatrixXd samples;
  /// (6 n) x closures: how the nodes would move without each closure on which the map hinges; may have no columns.
  Eigen::MatrixXd shifts;
  /// (6 m) x (6 m): joint covariance of the m = ChainUncertainty::spread(n).size() spread nodes. Empty: no directions.
  Eigen::MatrixXd spread_covariance;
  /// Of spread node k relative to k - 1 by odometry alone; the first is not used. Positive definite.
  std::vector<Matrix6d> spread_odometry;
};

/// Fewer samples than these say nothing of scales.
inline constexpr Eigen::Index kLeastSamples = 16;

/// How sure the map is of one chain, in the terms in which a robot compares itself with it (docs/math.md).
///
/// Scales: the samples pass through the same alignment and filters as a robot's difference does; the sigma of a
/// coefficient is that of its worst direction, from the samples' covariance shrunk towards its mean (OAS).
/// Directions: at most four vectors v with the smallest v^T P v / v^T O v below a quarter, where P is the map's
/// covariance of the spread nodes as seen from the first, and O odometry's. What is doubted is one shift, and the
/// larger, the less likely odometry finds it. `products`, unless null, is increased by the number of filtered columns
/// times the products with the graph's Laplacian that each took.
ChainUncertainty chain_uncertainty(const ProxyGraph& graph, const ChainId& chain, const ChainKnowledge& known,
                                   std::size_t* products = nullptr);

/// The graph with this chain's nodes where a robot should follow them: without what is doubted, which motions of space
/// spread over the nodes between the spread ones.
ProxyGraph without_doubted(const ProxyGraph& graph, const ChainId& chain);

/// Of a judge who is as sure as this of every node, evenly at all scales that so many nodes are enough for.
ChainUncertainty even_uncertainty(const ChainId& chain, std::size_t nodes, const PoseSigma& sigma);

}  // namespace tutti::consistency
