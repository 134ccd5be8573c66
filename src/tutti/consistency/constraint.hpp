// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tutti/base/config.hpp"
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
  std::uint32_t support = 0;   ///< Smallest support on the way between the two nodes.
  friend bool operator==(const Constraint&, const Constraint&) = default;
};

struct ConstraintConfig {
  double floor_translation_m = 1e-3;
  double floor_rotation_rad = 1e-3;
  double trust = 0.1;
  double doubt = 2.0;
  int full_support = 3;

  template <class V>
  void describe(V& v) {
    v.field("floor_translation_m", floor_translation_m, greater_than(0.0),
            "Least standard deviation of the server's relative position, before trust.");
    v.field("floor_rotation_rad", floor_rotation_rad, greater_than(0.0),
            "Least standard deviation of the server's relative rotation, before trust.");
    v.field(
        "trust", trust, between(1e-3, 1.0),
        "Standard deviation of a well supported constraint as a fraction of the server's own: the server's estimate "
        "already contains the robot's odometry, so the constraint has to outweigh it.");
    v.field("doubt", doubt, between(1e-3, 10.0), "The same for a stretch that a single closure supports.");
    v.field("full_support", full_support, at_least(1.0),
            "Closures over a stretch that earn full trust. A constraint with fewer is doubtful: it also gets the "
            "smoother's robust loss.");
  }
};

/// Standard deviation of a stretch with `support` closures, as a factor on the one the server sent: from `doubt` for a
/// single closure down to `trust` for `full_support` of them and more, evenly in the logarithm; 1 without any. At 1 the
/// server weighs no more than the robot's own odometry (of which its estimate is then made), at `trust` it overrules it
/// (docs/math.md, "Constraints"); a lone closure moves the robot by 1 / (1 + doubt^2) of what it asks for.
double distrust(std::uint32_t support, const ConstraintConfig& config);

/// Fewer closures than earn full trust stand behind it somewhere on the way.
inline bool is_doubtful(const Constraint& constraint, const ConstraintConfig& config) {
  return static_cast<int>(constraint.support) < config.full_support;
}

/// Makes constraints between synchronised nodes of one robot from the server's poses.
///   T_from_to = T_world_from^-1 T_world_to,
///   cov = sum over the proxy nodes k in (from, to] of distrust(k)^2 Ad(T_to_k) cov_k Ad(T_to_k)^T
///         + distrust(the least supported k)^2 floor^2,
/// that is: the nodes' covariances compounded along the chain, none better than the floor, each scaled by trust. The
/// floor is scaled too: a floor of 1 mrad on a link of 1 m between nodes whose odometry is as good would leave the
/// robot half-way (measured: 1295 consecutive links end 1.1 m from the server instead of centimetres). O(1) per
/// constraint after O(n) preparation, but for the least support. Keeps copies only; the arguments may go.
class ConstraintMaker {
 public:
  ConstraintMaker(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes,
                  std::span<const NodePair> pairs, const ConstraintConfig& config);

  /// Between pairs a and b (positions in `pairs`), a != b; the result runs from the earlier to the later.
  [[nodiscard]] Constraint make(std::size_t a, std::size_t b, ConstraintKind kind) const;
  [[nodiscard]] std::size_t size() const { return nodes_.size(); }

 private:
  struct Node {
    Timestamp stamp;
    std::size_t chain_index = 0;
    Pose3 T_start_body;       // server's estimate, seen from the robot's first proxy node
    Matrix6d covariance_sum;  // of all stretches up to this node, in the frame of the first proxy node
    std::size_t proxy = 0;    // rank among this robot's proxy nodes
  };
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> support_;  // of every proxy node of this robot, in time order
  std::uint64_t revision_ = 0;
  ConstraintConfig config_;
};

}  // namespace tutti::consistency
