// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/constraint.hpp"

#include <algorithm>
#include <cmath>

#include "tutti/base/check.hpp"

namespace tutti::consistency {
namespace {

Matrix6d moved(const Pose3& T_a_b, const Matrix6d& covariance_b) {
  const Matrix6d Ad = adjoint(T_a_b);
  return Ad * covariance_b * Ad.transpose();
}

}  // namespace

double distrust(std::uint32_t support, const ConstraintConfig& config) {
  if (support == 0) return 1.0;
  if (static_cast<int>(support) >= config.full_support) return config.trust;
  const double earned = (support - 1.0) / (config.full_support - 1.0);
  return std::pow(config.doubt, 1.0 - earned) * std::pow(config.trust, earned);
}

ConstraintMaker::ConstraintMaker(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                                 std::span<const NodePair> pairs, const ConstraintConfig& config)
    : revision_(graph.revision), config_(config) {
  std::vector<std::size_t> own;  // this chain's proxy nodes in time order
  for (std::size_t i = 0; i < graph.nodes.size(); ++i)
    if (graph.nodes[i].chain == chain) own.push_back(i);
  std::stable_sort(own.begin(), own.end(),
                   [&](std::size_t a, std::size_t b) { return graph.nodes[a].stamp < graph.nodes[b].stamp; });
  nodes_.reserve(pairs.size());
  if (own.empty()) return;

  // In the frame of the first proxy node the stretches' covariances simply add; make() moves the difference of two sums
  // to the frame of the constraint. Equal to compounding from node to node, without the loop.
  const Pose3 T_start_world = graph.nodes[own[0]].T_world_body.inverse();
  Matrix6d sum = Matrix6d::Zero();
  std::size_t pair = 0;
  for (std::size_t rank = 0; rank < own.size(); ++rank) {
    const ProxyNode& node = graph.nodes[own[rank]];
    const Pose3 T_start_body = T_start_world * node.T_world_body;
    const double factor = distrust(node.support, config);
    if (rank > 0) sum += moved(T_start_body, factor * factor * node.covariance);
    support_.push_back(node.support);
    if (pair < pairs.size() && pairs[pair].proxy == own[rank]) {
      nodes_.push_back({node.stamp, nodes[pairs[pair].robot].chain_index, T_start_body, sum, rank});
      ++pair;
    }
  }
  TUTTI_CHECK(pair == pairs.size(), "{} of {} pairs are nodes of robot {} in time order", pair, pairs.size(),
              to_string(chain));
}

Constraint ConstraintMaker::make(std::size_t a, std::size_t b, ConstraintKind kind) const {
  TUTTI_CHECK(a != b && a < nodes_.size() && b < nodes_.size(), "a = {}, b = {}, {} nodes", a, b, nodes_.size());
  const Node& from = nodes_[std::min(a, b)];
  const Node& to = nodes_[std::max(a, b)];
  Constraint out{from.stamp, to.stamp, from.chain_index, to.chain_index, {}, kind, revision_};
  out.support = *std::min_element(support_.begin() + static_cast<std::ptrdiff_t>(from.proxy) + 1,
                                  support_.begin() + static_cast<std::ptrdiff_t>(to.proxy) + 1);
  out.measurement.T_a_b = from.T_start_body.inverse() * to.T_start_body;
  Matrix6d covariance = moved(to.T_start_body.inverse(), to.covariance_sum - from.covariance_sum);
  covariance = 0.5 * (covariance + covariance.transpose()).eval();
  const double factor = distrust(out.support, config_);
  covariance.diagonal().head<3>().array() += std::pow(factor * config_.floor_translation_m, 2);
  covariance.diagonal().tail<3>().array() += std::pow(factor * config_.floor_rotation_rad, 2);
  out.measurement.covariance = covariance;
  return out;
}

}  // namespace tutti::consistency
