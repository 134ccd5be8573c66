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

/// The group of scales that asked for a constraint; other = a policy that does not look at scales.
enum class ConstraintKind { small, mid, large, other };

/// A relative pose between two of the robot's own nodes, taken from the server's map.
struct Constraint {
  Timestamp from_stamp, to_stamp;  ///< Identify the nodes; from is the earlier.
  std::size_t from = 0, to = 0;    ///< RobotNode::chain_index
  RelativePose measurement;        ///< T_from_to
  ConstraintKind kind = ConstraintKind::other;
  std::uint64_t revision = 0;  ///< Of the proxy graph it was taken from.
  friend bool operator==(const Constraint&, const Constraint&) = default;
};

/// Makes constraints between synchronised nodes of one robot from the server's poses: T_from_to = T_world_from^-1
/// T_world_to, with the covariances of the proxy nodes on the way compounded along it, scaled by kOdometryInside^2. The
/// server's estimate is made of the robot's own odometry and of closures. Next to that same odometry it must not be
/// weighed as if it were news, half and half (1295 consecutive links end 1.1 m from the server then): a link stands in
/// the place of the odometry that it spans, which still shapes what lies between its ends. Keeps copies only; the
/// arguments may go.
class ConstraintMaker {
 public:
  static constexpr double kOdometryInside = 3e-3;

  ConstraintMaker(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                  std::span<const NodePair> pairs);

  /// Between pairs a and b (positions in `pairs`), a != b; the result runs from the earlier to the later.
  [[nodiscard]] Constraint make(std::size_t a, std::size_t b, ConstraintKind kind) const;
  [[nodiscard]] std::size_t size() const { return ends_.size(); }

 private:
  struct End {
    Timestamp stamp;
    std::size_t chain_index = 0;
    std::size_t node = 0;  // among the chain's proxy nodes
  };
  std::vector<ProxyNode> nodes_;  // of the chain
  std::vector<End> ends_;         // the synchronised ones
  std::uint64_t revision_ = 0;
};

}  // namespace tutti::consistency
