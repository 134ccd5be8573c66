// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/consistency/robot_node.hpp"
#include "tutti/consistency/synchronise.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::consistency {

/// Settings of the paper's comparison.
struct CompareConfig {
  int scales = 7;
  std::string signal = "distance";
  double tolerance_m = 1e-3;  ///< Largest error of a disagreement against the exact transform.
  bool exact = false;         ///< Full eigendecomposition instead of Chebyshev polynomials: slow, cubic in the nodes.

  template <class V>
  void describe(V& v) {
    v.field("scales", scales, at_least(2.0), "Filters of the Meyer bank, the low-pass included.");
    v.field("signal", signal, one_of({"distance", "pose", "relative_motion"}),
            "What is compared: 'distance' to the first node (the paper), 'pose' seen from the first node, or "
            "'relative_motion' from node to node.");
  }
};

/// Where, and at which scale, the robot's estimate disagrees with the server's, by the paper's measure.
struct Comparison {
  std::vector<NodePair> pairs;   ///< The synchronised nodes in time order; pairs[r] belongs to row r of `disagreement`.
  Eigen::MatrixXd disagreement;  ///< pairs x scales: d^s of eq. (8), metres; scale 0 = largest. Empty when nodes were
                                 ///< only synchronised.
  double lambda_max = 0.0;  ///< Common to both filter banks: the larger of the two graphs' largest eigenvalues; 0 when
                            ///< there are no edges.
  int order = 0;            ///< Order of the Chebyshev polynomials (the larger of the two graphs'); 0: exact transform.
};

/// Section III of the paper, steps 4 and 5: synchronises, builds the robot's own graph by the server's rule, filters
/// both signals, and returns d^s.
///
/// The two graphs are the subgraphs induced by this robot's synchronised nodes. If the server's graph is reduced, its
/// weights are those that it carries; the robot reduces its own graph over kept and eliminated nodes to the kept ones,
/// and keeps the edges that the server kept. Equal poses then give d^s = 0, reduced or not. A robot that lacks some
/// nodes of a reduced graph reduces those it has; the graphs then differ, and d^s does not vanish even for equal poses:
/// near the gap at every scale, everywhere at the large ones.
///
/// With fewer than two pairs the disagreement is 0. Nodes without edges keep their whole signal in scale 0. An unknown
/// `config.signal` throws.
Comparison compare(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                   const CompareConfig& config);

/// A graph over n nodes with a signal.
struct GraphSignal {
  const Eigen::SparseMatrix<double>& laplacian;  ///< n x n
  const Eigen::MatrixXd& signal;                 ///< n x d
  double largest_eigenvalue = 0.0;               ///< As spectral::ChebyshevConfig has it; 0 when the graph has no edge.
};

/// The core of compare(): two graphs over the same n nodes -> d^s, n x scales. `order` is set to the polynomial order.
Eigen::MatrixXd disagreement(const GraphSignal& server, const GraphSignal& robot, const CompareConfig& config,
                             int& order);

}  // namespace tutti::consistency
