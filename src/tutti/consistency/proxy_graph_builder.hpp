// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::consistency {

/// A representative node of the server's map, with its latest estimate: the input of the proxy graph.
struct ServerNode {
  ChainId chain;
  Timestamp stamp;
  Pose3 T_world_body;
  /// Covariance of this pose relative to the same chain's previous ServerNode (right tangent); ignored for the first.
  Matrix6d covariance = Matrix6d::Zero();
};

/// How a proxy graph is made, and how much it contains about the server's uncertainty.
struct ProxyGraphConfig {
  double radius_m = 7.0;
  double sigma_m = 1.0;
  int node_budget = 0;
  std::string reducer = "budget";
  double sparsify_threshold = 1e-3;  ///< A reduced edge is dropped when its weight is below this fraction of the
                                     ///< smaller degree of its ends, unless it holds the graph together; 0 = keep all.
  /// Number of samples from which the server estimates how sure it is of each trajectory's shape; 0 = none is sent.
  int shape_samples = 64;
  int shape_deletions = 32;

  template <class V>
  void describe(V& v) {
    v.field("radius_m", radius_m, greater_than(0.0), "Nodes closer than this are neighbours.");
    v.field("sigma_m", sigma_m, greater_than(0.0), "Scale of the edge weights exp(-d / (2 sigma^2)), eq. 1.");
    v.field("node_budget", node_budget, at_least(0.0),
            "Reduce the proxy graph to this many nodes over all robots; 0 = never. The first and last node of every "
            "robot are always kept, even if they alone are more.");
    v.field(
        "reducer", reducer, one_of({"budget", "paper"}),
        "Which nodes stay: 'budget' meets node_budget and is reproducible; 'paper' keeps u_max(n) >= 0 (eq. 3) once "
        "the graph exceeds node_budget.");
    v.field("shape_deletions", shape_deletions, between(0.0, 10'000.0),
            "And that the closures of any one pair of places may be wrong: how many of such groups on which the map "
            "hinges, the most influential ones, are taken away one by one to see what would change; 0 = none.");
  }
};

/// The proxy graph that the graph monitor broadcasts. Nodes are sorted by (chain, stamp), so the result does not depend
/// on the order of `nodes`. A repeated (chain, stamp) throws.
///
/// Above the budget each chain is reduced on the subgraph induced by its own nodes, so that its robot can repeat the
/// reduction on its own estimate: Schur complement of the Laplacian (eq. 3), then sparsification. Chains share the
/// budget in proportion to their nodes, with at least two nodes each (one if the chain has one). The covariance of a
/// kept node compounds those of the removed nodes before it.
ProxyGraph build_proxy_graph(std::uint64_t revision, std::vector<ServerNode> nodes,
                             std::vector<ChainComponent> components, const ProxyGraphConfig& config);

/// Sets where the chain's robot was last seen to the end of `chain`, its newest one; does nothing when the graph has no
/// nodes of the chain.
void see_last_in(ProxyGraph& graph, const ChainId& chain);

/// The part of the graph that this robot needs: everything about its newest chain (the one it was last seen in), and
/// where the robots of the same component were last seen. A robot without nodes gets the fields that belong to no
/// chain. Nothing outside this part changes what the robot does.
ProxyGraph own_part(const ProxyGraph& whole, RobotId robot);

}  // namespace tutti::consistency
