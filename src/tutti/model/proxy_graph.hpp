// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti {

/// A proxy node: one representative keyframe as the server estimates it.
struct ProxyNode {
  ChainId chain;
  Timestamp stamp;
  Pose3 T_world_body;
  /// Covariance of this pose relative to the same chain's previous proxy node (right tangent); zero for the first.
  Matrix6d covariance = Matrix6d::Zero();
  friend bool operator==(const ProxyNode&, const ProxyNode&) = default;
};

/// Undirected edge that the Kron reduction left between two nodes of one chain; `a` and `b` index ProxyGraph::nodes.
struct ProxyEdge {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  double weight = 0.0;
  friend bool operator==(const ProxyEdge&, const ProxyEdge&) = default;
};

/// A node that the Kron reduction removed. The robot needs to know it to reduce its own graph to the same nodes.
struct EliminatedNode {
  ChainId chain;
  Timestamp stamp;
  friend bool operator==(const EliminatedNode&, const EliminatedNode&) = default;
};

/// Which component of the map a chain is in. Chains of one component share a `world`; worlds of different components
/// are unrelated.
struct ChainComponent {
  ChainId chain;
  std::uint32_t component = 0;
  friend bool operator==(const ChainComponent&, const ChainComponent&) = default;
};

/// Where a robot's part of the map ends: the last node of the newest of its chains that has nodes.
struct LastSeen {
  ChainId chain;
  Timestamp stamp;
  Pose3 T_world_body;
  std::string name;  ///< The robot's own name for itself; empty where the server does not know.
  friend bool operator==(const LastSeen&, const LastSeen&) = default;
};

/// Standard deviations along the worst direction.
struct PoseSigma {
  double position_m = 0.0;
  double rotation_rad = 0.0;
  friend bool operator==(const PoseSigma&, const PoseSigma&) = default;
};

/// Standard deviations of the wavelet coefficients of a chain's errors at one scale.
struct ScaleUncertainty {
  /// One entry per block of ChainUncertainty::kBlock nodes, the largest of its nodes; empty when the chain is too short
  /// for the scale to be tested.
  std::vector<PoseSigma> sigma;
  friend bool operator==(const ScaleUncertainty&, const ScaleUncertainty&) = default;
};

/// A linear combination of a chain's poses that closures determine much better than odometry does:
///   sum over the spread nodes k >= 1 of (position_k . dp_k / 127 + rotation_scale rotation_k . dr_k / 127),
/// where dp_k [m] and dr_k [rad] are the errors of node k relative to the chain's first node, along the axes of
/// `world`. Coefficients are quantised to one byte each.
struct KnownDirection {
  std::vector<std::int8_t> position, rotation;  ///< 3 entries for each spread node but the first.
  double rotation_scale = 1.0;
  double sigma = 0.0;  ///< Standard deviation of the combination.
  friend bool operator==(const KnownDirection&, const KnownDirection&) = default;
};

/// How sure the server is of the shape of one chain's trajectory (docs/math.md): the standard deviations of its errors
/// in the wavelets of the chain's own proximity graph, and along the directions that closures determine. Also has which
/// part of the shape depends on one pair of places whose closures odometry contradicts.
struct ChainUncertainty {
  static constexpr std::size_t kBlock = 10;  ///< Nodes that share one sigma.
  /// Number of evenly spread nodes that directions refer to; fewer on short chains.
  static constexpr std::size_t kSpread = 24;
  /// Limits of the wire format.
  static constexpr std::size_t kMostScales = 16;
  static constexpr std::size_t kMostDirections = 16;
  static constexpr std::size_t blocks(std::size_t nodes) { return (nodes + kBlock - 1) / kBlock; }
  /// Indices of the nodes that directions refer to; none when the chain has fewer than two nodes.
  static std::vector<std::size_t> spread(std::size_t nodes) {
    std::vector<std::size_t> out;
    const std::size_t count = nodes < 2 ? 0 : std::min(nodes, kSpread);
    for (std::size_t i = 0; i < count; ++i) out.push_back(i * (nodes - 1) / (count - 1));
    return out;
  }
  ChainId chain;
  /// Expected root mean square error over the nodes: of positions after one rigid alignment (the RMSE of the ATE that
  /// the server expects), and of rotations after removing their mean.
  PoseSigma whole;
  std::vector<ScaleUncertainty> scales;  ///< Those of the Meyer filter bank on the chain's graph; scale 0 = largest.
  std::vector<KnownDirection> directions;
  /// The part of the shape that rests on one pair of places contradicted by odometry, as a shift. A robot that shall
  /// not follow it moves spread node k >= 1, as seen from the first, by sigma (position_k / 127, rotation_scale
  /// rotation_k / 127), in m and rad.
  std::optional<KnownDirection> doubted;
  friend bool operator==(const ChainUncertainty&, const ChainUncertainty&) = default;
};

/// The proxy graph: the server's map reduced to kilobytes, or the part of it that one robot is sent
/// (consistency::own_part). Unreduced graphs carry no edges, because these follow from the positions by one rule
/// (`radius_m`, `sigma_m`; eqs. 1, 2); reduced graphs carry `edges` and `eliminated`.
struct ProxyGraph {
  static constexpr std::size_t kMostChains = 1'000;  ///< Limit on the sessions of all robots together.
  /// Grows with every new map, and when a MapServer goes on from a saved state, which may be older than what robots
  /// have heard. A node::ServerNode that starts again on its own store keeps it.
  std::uint64_t epoch = 0;
  std::uint64_t revision = 0;  ///< Counts the broadcasts of an epoch.
  /// A random number of the server's start that made the graph. A graph of another incarnation than the last one heard
  /// is newer whatever its epoch and revision are, because an older map may have been restored. 0: unknown.
  std::uint32_t incarnation = 0;
  double radius_m = 7.0;
  double sigma_m = 1.0;
  std::vector<ProxyNode> nodes;            ///< Sorted by (chain, stamp).
  std::vector<ChainComponent> components;  ///< Sorted by chain.
  bool reduced = false;
  std::vector<ProxyEdge> edges;
  std::vector<EliminatedNode> eliminated;  ///< Sorted by (chain, stamp).
  /// Sorted by chain; of chains that are missing the server sends no uncertainty.
  std::vector<ChainUncertainty> uncertainties;
  std::vector<LastSeen> last_seen;  ///< Sorted by chain, at most one per robot; the chain is in `components`.
  friend bool operator==(const ProxyGraph&, const ProxyGraph&) = default;

  /// (epoch, revision); of two graphs with one incarnation the larger age is the newer one. Epochs come first, so that
  /// a server restarted from an older state is heard at once.
  [[nodiscard]] std::pair<std::uint64_t, std::uint64_t> age() const { return {epoch, revision}; }
};

/// The nodes of one chain, in time order; logarithmic search.
inline std::span<const ProxyNode> nodes_of(const ProxyGraph& graph, const ChainId& chain) {
  const auto [first, last] = std::ranges::equal_range(graph.nodes, chain, {}, &ProxyNode::chain);
  return {first, last};
}

/// How sure the server is of this chain; null when it has not sent it.
inline const ChainUncertainty* uncertainty_of(const ProxyGraph& graph, const ChainId& chain) {
  const auto found = std::ranges::find(graph.uncertainties, chain, &ChainUncertainty::chain);
  return found == graph.uncertainties.end() ? nullptr : &*found;
}

/// The component of this chain; nothing when the graph does not have the chain.
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
