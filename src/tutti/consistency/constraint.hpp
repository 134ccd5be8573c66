// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tutti/consistency/robot_node.hpp"
#include "tutti/consistency/synchronise.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::consistency {

/// The group of scales that asked for a constraint; `other` comes from policies that do not use scales.
enum class ConstraintKind { small, mid, large, other };

/// A constraint: a relative pose between two of the robot's own nodes, taken from the server's map.
struct Constraint {
  Timestamp from_stamp, to_stamp;  ///< They identify the nodes; `from` is the earlier one.
  std::size_t from = 0, to = 0;    ///< RobotNode::chain_index
  RelativePose measurement;        ///< T_from_to
  ConstraintKind kind = ConstraintKind::other;
  std::uint64_t revision = 0;  ///< Revision of the proxy graph that it was taken from.
  friend bool operator==(const Constraint&, const Constraint&) = default;
};

/// Makes constraints between synchronised nodes of one robot from the server's poses: T_from_to = T_world_from^-1
/// T_world_to. Its covariance compounds those of the proxy nodes in between, multiplied by kOdometryInside^2.
///
/// The factor is there because the server's estimate already contains the robot's own odometry. If a constraint were
/// weighed against that odometry as an independent measurement, the robot would end halfway between both (with 1295
/// consecutive constraints, 1.1 m from the server). So a constraint replaces the odometry that it spans, which then
/// only shapes what lies between its ends.
///
/// The maker copies what it needs; its arguments need not outlive it.
class ConstraintMaker {
 public:
  static constexpr double kOdometryInside = 3e-3;

  ConstraintMaker(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                  std::span<const NodePair> pairs);

  /// The constraint between pairs[a] and pairs[b], a != b; it runs from the earlier node to the later one.
  [[nodiscard]] Constraint make(std::size_t a, std::size_t b, ConstraintKind kind) const;
  [[nodiscard]] std::size_t size() const { return ends_.size(); }

 private:
  struct End {
    Timestamp stamp;
    std::size_t chain_index = 0;
    std::size_t node = 0;  // among the chain's proxy nodes
  };
  std::vector<ProxyNode> nodes_;  // of the chain
  std::vector<End> ends_;         // the synchronised nodes
  std::uint64_t revision_ = 0;
};

}  // namespace tutti::consistency
