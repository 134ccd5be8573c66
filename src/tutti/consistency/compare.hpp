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

struct CompareConfig {
  int scales = 7;
  std::string signal = "distance";
  double tolerance_m = 1e-3;
  bool exact = false;

  template <class V>
  void describe(V& v) {
    v.field("scales", scales, at_least(2.0), "Filters of the Meyer bank, the low-pass included.");
    v.field("signal", signal, one_of({"distance", "pose", "relative_motion"}),
            "What is compared: 'distance' to the first node (the paper), 'pose' seen from the first node, or "
            "'relative_motion' from node to node.");
    v.field("tolerance_m", tolerance_m, greater_than(0.0),
            "Largest error of a disagreement against the exact transform.");
    v.field("exact", exact, any(),
            "Full eigendecomposition instead of Chebyshev polynomials: slow, cubic in the nodes.");
  }
};

/// Where, and at which scale, the robot's estimate disagrees with the server's.
struct Comparison {
  std::vector<NodePair> pairs;   ///< The synchronised nodes in time order: row r of `disagreement` is pairs[r].
  Eigen::MatrixXd disagreement;  ///< pairs x scales, d^s of eq. (8), metres; scale 0 = largest. Empty when only
                                 ///< synchronised.
  double lambda_max = 0.0;       ///< Common to both filter banks: the larger of the two graphs'. 0 = no edges.
  int order = 0;                 ///< Of the Chebyshev polynomials (the larger of the two); 0 = exact.
};

/// Section III of the paper, steps 4 and 5: synchronise, build the robot's own graph by the server's rule, filter both
/// signals, d^s.
///
/// Compared are the subgraphs induced on this robot's synchronised nodes. If the server's graph is reduced, its side is
/// the carried weights, and the robot reduces its own graph over kept + eliminated nodes to the kept ones and keeps the
/// edges the server kept: equal poses then give d^s = 0 in both cases. If the robot lacks some of the nodes of a
/// reduced graph, it reduces what it has; the two graphs then differ and d^s does not vanish even for equal poses: near
/// the gap in every scale, all along in the large ones. Fewer than two pairs: disagreement is 0 for the pairs there
/// are. Nodes without edges keep their whole signal in scale 0. `config.signal` must be known (checked).
Comparison compare(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                   const CompareConfig& config);

/// The core: two graphs over the same n nodes (Laplacians) with a signal each (n x d) -> n x scales. `lambda_max` must
/// be at least either graph's largest eigenvalue; 0 when neither has an edge. Returns the polynomial order in `order`.
Eigen::MatrixXd disagreement(const Eigen::SparseMatrix<double>& L_server, const Eigen::MatrixXd& f_server,
                             const Eigen::SparseMatrix<double>& L_robot, const Eigen::MatrixXd& f_robot,
                             double lambda_max, const CompareConfig& config, int& order);

}  // namespace tutti::consistency
