// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/constraint.hpp"

#include <algorithm>

#include "tutti/base/check.hpp"
#include "tutti/geometry/covariance.hpp"

namespace tutti::consistency {

ConstraintMaker::ConstraintMaker(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                                 std::span<const NodePair> pairs)
    : revision_(graph.revision) {
  const std::span<const ProxyNode> own = nodes_of(graph, chain);
  nodes_.assign(own.begin(), own.end());
  for (const NodePair& pair : pairs) {
    const auto node = static_cast<std::size_t>(&graph.nodes[pair.proxy] - own.data());
    TUTTI_CHECK(node < own.size() && (ends_.empty() || ends_.back().node < node),
                "the pairs are not nodes of robot {} in time order", to_string(chain));
    ends_.push_back({own[node].stamp, nodes[pair.robot].chain_index, node});
  }
}

Constraint ConstraintMaker::make(std::size_t a, std::size_t b, ConstraintKind kind) const {
  TUTTI_CHECK(a != b && a < ends_.size() && b < ends_.size(), "a = {}, b = {}, {} nodes", a, b, ends_.size());
  const auto& [from, to] = std::minmax(ends_[a], ends_[b], [](const End& x, const End& y) { return x.node < y.node; });
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t k = from.node + 1; k <= to.node; ++k)
    covariance = compound_covariance(nodes_[k - 1].T_world_body.inverse() * nodes_[k].T_world_body, covariance,
                                     nodes_[k].covariance);
  return {.from_stamp = from.stamp,
          .to_stamp = to.stamp,
          .from = from.chain_index,
          .to = to.chain_index,
          .measurement = {nodes_[from.node].T_world_body.inverse() * nodes_[to.node].T_world_body,
                          kOdometryInside * kOdometryInside *
                              invertible_covariance(0.5 * (covariance + covariance.transpose()))},
          .kind = kind,
          .revision = revision_};
}

}  // namespace tutti::consistency
