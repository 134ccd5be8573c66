// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti {

/// One representative keyframe as the server estimates it.
struct ProxyNode {
  ChainId chain;
  Timestamp stamp;
  Pose3 T_world_body;
  /// Covariance of this pose relative to the same chain's previous proxy node (right tangent); zero for the first.
  Matrix6d covariance = Matrix6d::Zero();
  friend bool operator==(const ProxyNode&, const ProxyNode&) = default;
};

/// Undirected edge between two nodes of one chain that the Kron reduction kept; indices into ProxyGraph::nodes.
struct ProxyEdge {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  double weight = 0.0;
  friend bool operator==(const ProxyEdge&, const ProxyEdge&) = default;
};

/// A node that the Kron reduction removed. The robot needs it to reduce its own graph to the same nodes.
struct EliminatedNode {
  ChainId chain;
  Timestamp stamp;
  friend bool operator==(const EliminatedNode&, const EliminatedNode&) = default;
};

/// Which chains share one gauge: chains of different components have unrelated `world` frames.
struct ChainComponent {
  ChainId chain;
  std::uint32_t component = 0;
  friend bool operator==(const ChainComponent&, const ChainComponent&) = default;
};

/// Where a robot was when its map ends: the last node of the newest of its chains that have nodes.
struct LastSeen {
  ChainId chain;
  Timestamp stamp;
  Pose3 T_world_body;
  friend bool operator==(const LastSeen&, const LastSeen&) = default;
};

/// Standard deviations in the direction that is worst.
struct PoseSigma {
  double position_m = 0.0;
  double rotation_rad = 0.0;
  friend bool operator==(const PoseSigma&, const PoseSigma&) = default;
};

/// What the wavelet coefficients of a chain's errors are like at one scale.
struct ScaleUncertainty {
  /// Per block of ChainUncertainty::kBlock nodes the largest of its nodes; empty: too few waves to say anything.
  std::vector<PoseSigma> sigma;
  friend bool operator==(const ScaleUncertainty&, const ScaleUncertainty&) = default;
};

/// A combination of a chain's poses that closures know far better than odometry does:
///   sum over the spread nodes k >= 1 of (position_k . dp_k / 127 + rotation_scale rotation_k . dr_k / 127),
/// dp_k [m] and dr_k [rad] what node k is off by, seen from the chain's first node, in the axes of `world`.
struct KnownDirection {
  std::vector<std::int8_t> position, rotation;  ///< 3 per spread node but the first.
  double rotation_scale = 1.0;
  double sigma = 0.0;  ///< Standard deviation of the combination.
  friend bool operator==(const KnownDirection&, const KnownDirection&) = default;
};

/// How sure the server is of the shape of one chain's trajectory, with the errors seen through the wavelets of the
/// chain's own proximity graph and through the directions that closures know. What hangs on
/// one closure is doubted where odometry speaks against it (docs/math.md).
struct ChainUncertainty {
  static constexpr std::size_t kBlock = 10;   ///< Nodes that share a sigma.
  static constexpr std::size_t kSpread = 24;  ///< Evenly spread nodes that directions speak of; fewer on short chains.
  static constexpr std::size_t kMostScales = 16;
  static constexpr std::size_t kMostDirections = 16;
  static constexpr std::size_t blocks(std::size_t nodes) { return (nodes + kBlock - 1) / kBlock; }
  /// Which of a chain's nodes directions speak of; none if it has fewer than two.
  static std::vector<std::size_t> spread(std::size_t nodes) {
    std::vector<std::size_t> out;
    const std::size_t count = nodes < 2 ? 0 : std::min(nodes, kSpread);
    for (std::size_t i = 0; i < count; ++i) out.push_back(i * (nodes - 1) / (count - 1));
    return out;
  }
  ChainId chain;
  /// Root mean square over the nodes of what each is off by: in position after one rigid alignment (the RMSE of the ATE
  /// that the server expects), in rotation less the mean.
  PoseSigma whole;
  std::vector<ScaleUncertainty> scales;  ///< Of the Meyer bank on the chain's graph; scale 0 = largest.
  std::vector<KnownDirection> directions;
  /// What rests on a single closure that odometry contradicts, as a shift: spread node k >= 1 as seen from the first
  /// moves by sigma (position_k / 127, rotation_scale rotation_k / 127), m and rad, when robots are not to follow it.
  std::optional<KnownDirection> doubted;
  friend bool operator==(const ChainUncertainty&, const ChainUncertainty&) = default;
};

/// The server's map in kilobytes, or what one robot is sent of it (consistency::own_part). Unreduced, edges follow from
/// the positions by one rule (radius, sigma; eqs. 1, 2) and are not carried; reduced, `edges` and `eliminated` are.
struct ProxyGraph {
  static constexpr std::size_t kMostChains = 1'000;  ///< Sessions of all robots together.
  std::uint64_t epoch = 0;     ///< Of the server that made it; grows whenever the server starts again.
  std::uint64_t revision = 0;  ///< Counts up with every broadcast of an epoch.
  /// Of the server's start that made it, at random: of another one than was heard last, a graph is newer whatever its
  /// epoch and revision, since the map may be an older one that was put back. 0: it was not said.
  std::uint32_t incarnation = 0;
  double radius_m = 7.0;
  double sigma_m = 1.0;
  std::vector<ProxyNode> nodes;            ///< Sorted by (chain, stamp).
  std::vector<ChainComponent> components;  ///< Sorted by chain.
  bool reduced = false;
  std::vector<ProxyEdge> edges;
  std::vector<EliminatedNode> eliminated;       ///< Sorted by (chain, stamp).
  std::vector<ChainUncertainty> uncertainties;  ///< Sorted by chain; a chain may be missing: nothing is known.
  std::vector<LastSeen> last_seen;              ///< Sorted by chain, one a robot at most; the chain has a component.
  friend bool operator==(const ProxyGraph&, const ProxyGraph&) = default;

  /// The larger one is newer: a server that goes on from an older state than its robots have heard of is heard at once.
  [[nodiscard]] std::pair<std::uint64_t, std::uint64_t> age() const { return {epoch, revision}; }
};

/// The nodes of one chain.
inline std::span<const ProxyNode> nodes_of(const ProxyGraph& graph, const ChainId& chain) {
  const auto [first, last] = std::ranges::equal_range(graph.nodes, chain, {}, &ProxyNode::chain);
  return {first, last};
}

/// What the server says about this chain; null: nothing.
inline const ChainUncertainty* uncertainty_of(const ProxyGraph& graph, const ChainId& chain) {
  const auto found = std::ranges::find(graph.uncertainties, chain, &ChainUncertainty::chain);
  return found == graph.uncertainties.end() ? nullptr : &*found;
}

/// Nothing for a chain that the graph does not speak of.
inline std::optional<std::uint32_t> component_of(const ProxyGraph& graph, const ChainId& chain) {
  const auto found = std::ranges::find(graph.components, chain, &ChainComponent::chain);
  return found == graph.components.end() ? std::nullopt : std::optional(found->component);
}

/// T_world_body of one chain's nodes.
inline Trajectory trajectory_of(const ProxyGraph& graph, const ChainId& chain) {
  Trajectory out;
  for (const ProxyNode& node : graph.nodes)
    if (node.chain == chain) out.push_back({node.stamp, node.T_world_body});
  return out;
}

}  // namespace tutti
