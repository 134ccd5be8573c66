// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
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
  /// Independent closures that support the stretch from the previous proxy node to this one (docs/math.md).
  std::uint32_t support = 0;
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

/// Standard deviations in the direction that is worst.
struct ShapeSigma {
  double position_m = 0.0;
  double rotation_rad = 0.0;
  friend bool operator==(const ShapeSigma&, const ShapeSigma&) = default;
};

/// Two of a chain's proxy nodes, a before b, that the map knows relative to each other, T_a_b, much better than the way
/// between them alone would allow: what it knows of the two from closures.
struct ShapeTie {
  std::uint32_t a = 0;
  std::uint32_t b = 0;  ///< Counted along the chain's nodes in the graph; a < b.
  ShapeSigma sigma;     ///< Of T_a_b.
  friend bool operator==(const ShapeTie&, const ShapeTie&) = default;
};

/// How sure the server is of the shape of one chain's trajectory: stretch by stretch, over all, and across the ties.
/// Let x_k be what the estimate of the chain's k-th proxy node is off by: its position after one rigid alignment of all
/// the chain's nodes, its rotation (rotation vector) less the mean over all of them; both in the axes of `world`. Any
/// one closure may be wrong: what would change without the one that matters most counts as uncertainty too
/// (docs/math.md).
struct ShapeUncertainty {
  static constexpr std::size_t kShortest = 4;  ///< Half the length, in nodes, of the shortest stretches.
  /// How many stretches of scale j fit into a chain's nodes: sag[j].size(); 0 = sag ends before j.
  static constexpr std::size_t stretches(std::size_t nodes, std::size_t j) {
    return nodes == 0 || j >= 32 ? 0 : (nodes - 1) / (2 * kShortest << j);
  }
  ChainId chain;
  ShapeSigma whole;  ///< Root mean square of |x_k| over all nodes: the RMSE of the ATE that the server expects.
  /// sag[j][i]: of x_m - (x_a + x_b) / 2, what the middle of a stretch is off by when its ends are held, for the i-th
  /// stretch of 2 L nodes, L = kShortest 2^j: a = 2 L i, m = a + L, b = a + 2 L, counted along the chain's nodes in the
  /// graph. As many j as fit; sag[j].size() = (nodes - 1) / (2 L), see stretches().
  std::vector<std::vector<ShapeSigma>> sag;
  std::vector<ShapeTie> ties;  ///< Sorted by (a, b), none twice.
  friend bool operator==(const ShapeUncertainty&, const ShapeUncertainty&) = default;
};

/// The server's map in kilobytes. Unreduced, edges follow from the positions by one rule (radius, sigma; eqs. 1, 2) and
/// are not carried; reduced, `edges` and `eliminated` are.
struct ProxyGraph {
  static constexpr std::size_t kMostChains = 1'000;  ///< Sessions of all robots together.
  std::uint64_t epoch = 0;     ///< Of the server that made it; grows whenever the server starts again.
  std::uint64_t revision = 0;  ///< Counts up with every broadcast of an epoch.
  double radius_m = 7.0;
  double sigma_m = 1.0;
  std::vector<ProxyNode> nodes;  ///< Sorted by (chain, stamp).
  std::vector<ChainComponent> components;
  bool reduced = false;
  std::vector<ProxyEdge> edges;
  std::vector<EliminatedNode> eliminated;  ///< Sorted by (chain, stamp).
  std::vector<ShapeUncertainty> shapes;    ///< Sorted by chain; a chain may be missing: nothing is known.
  friend bool operator==(const ProxyGraph&, const ProxyGraph&) = default;

  /// The larger one is newer: a server that goes on from an older state than its robots have heard of is heard at once.
  [[nodiscard]] std::pair<std::uint64_t, std::uint64_t> age() const { return {epoch, revision}; }
};

/// T_world_body of one chain's nodes.
inline Trajectory trajectory_of(const ProxyGraph& graph, const ChainId& chain) {
  Trajectory out;
  for (const ProxyNode& node : graph.nodes)
    if (node.chain == chain) out.push_back({node.stamp, node.T_world_body});
  return out;
}

}  // namespace tutti
