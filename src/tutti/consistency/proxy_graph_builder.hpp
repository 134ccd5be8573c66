// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::consistency {

/// A representative node that the server keeps a reference to, with its latest estimate.
struct ServerNode {
  ChainId chain;
  Timestamp stamp;
  Pose3 T_world_body;
  /// Of this pose relative to the same chain's previous ServerNode (right tangent); ignored for the first.
  Matrix6d covariance = Matrix6d::Zero();
};

struct ProxyGraphConfig {
  double radius_m = 7.0;
  double sigma_m = 1.0;
  int node_budget = 0;
  std::string reducer = "budget";
  double sparsify_threshold = 1e-3;  ///< Drop a reduced edge whose weight is below this fraction of the smaller degree
                                     ///< of its ends, but none that holds the graph together; 0 = keep all.
  /// Samples from which the server learns how sure it is of each trajectory's shape; 0 = do not send it.
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
            "And that any one closure may be wrong: how many of those on which the map hinges, the most influential "
            "ones, are taken away one by one to see what would change; 0 = none.");
  }
};

/// What the graph monitor broadcasts: nodes sorted by (chain, stamp); whatever order `nodes` came in, the result is the
/// same. A repeated (chain, stamp) is our own mistake (checked).
///
/// Reduction (only above the budget) is done per chain on the subgraph induced by that chain's nodes, so that the robot
/// can repeat it on its own estimate: Schur complement of the Laplacian (eq. 3), then sparsified. The budget is shared
/// between the chains in proportion to their nodes, at least two each (one if the chain has one node). The covariance
/// of a kept node is compounded over the removed nodes before it.
ProxyGraph build_proxy_graph(std::uint64_t revision, std::vector<ServerNode> nodes,
                             std::vector<ChainComponent> components, const ProxyGraphConfig& config);

/// `chain` is its robot's newest, whatever the numbers: the robot was last seen in it, if the graph has nodes of it.
void see_last_in(ProxyGraph& graph, const ChainId& chain);

/// What this robot needs of the graph: all of its newest chain (the one it was last seen in), and where the robots of
/// the same component were last seen. Of a robot without nodes only what belongs to no chain. Nothing else in the graph
/// changes what a robot of that chain does with it.
ProxyGraph own_part(const ProxyGraph& whole, RobotId robot);

}  // namespace tutti::consistency
