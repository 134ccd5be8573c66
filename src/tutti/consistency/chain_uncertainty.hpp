// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "tutti/model/proxy_graph.hpp"

namespace tutti::consistency {

/// The map's knowledge of the errors of the n proxy nodes of one chain, to first order. Rows are right tangents
/// [translation m; rotation rad], six per node, nodes in time order.
struct ChainKnowledge {
  /// (6 n) x samples: joint draws of the nodes' errors, with zero mean.
  Eigen::MatrixXd samples;
  /// (6 n) x groups: for each group of closures on which the map hinges, how the nodes would move without it. May have
  /// no columns.
  Eigen::MatrixXd shifts;
  std::vector<std::size_t> shift_places;  ///< Per column of shifts, how many places along the chain the group measures.
  /// (6 m) x (6 m): joint covariance of the spread nodes, m = ChainUncertainty::spread(n).size(). Empty: directions are
  /// left out.
  Eigen::MatrixXd spread_covariance;
  /// Covariance of spread node k relative to k - 1 by odometry alone, positive definite; entry 0 is unused.
  std::vector<Matrix6d> spread_odometry;
};

/// With fewer samples there is no estimate per scale.
inline constexpr Eigen::Index kLeastSamples = 16;

/// How sure the map is of one chain, in the quantities with which a robot compares itself to the map (docs/math.md).
///
/// Scales: the samples go through the alignment and the filters that a robot's difference goes through. The sigma of a
/// coefficient is that along its worst direction, from the samples' covariance shrunk towards its mean (oracle
/// approximating shrinkage, OAS). Directions: at most four vectors v, those with the smallest v^T P v / v^T O v below a
/// quarter. P is the map's covariance of the spread nodes as seen from the first, O is odometry's. Doubted: the shift
/// by one group of closures, multiplied by a share that grows the less likely odometry finds it.
///
/// `products`, unless null, is increased by the number of filtered columns times the products with the graph's
/// Laplacian that each of them took.
ChainUncertainty chain_uncertainty(const ProxyGraph& graph, const ChainId& chain, const ChainKnowledge& known,
                                   std::size_t* products = nullptr);

/// The graph with the nodes of this chain where a robot should follow them: ChainUncertainty::doubted is taken back,
/// and the nodes between the spread ones move along by interpolated rigid motions.
ProxyGraph without_doubted(const ProxyGraph& graph, const ChainId& chain);

/// The uncertainty of a judge who is equally sure of every node, at every scale for which there are enough nodes.
ChainUncertainty even_uncertainty(const ChainId& chain, std::size_t nodes, const PoseSigma& sigma);

}  // namespace tutti::consistency
