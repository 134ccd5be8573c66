// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>

#include "tutti/model/proxy_graph.hpp"
#include "tutti/spectral/graph.hpp"

/// How server and robot see the errors of one chain's nodes: on the graph of the chain's own nodes where the
/// server has them, one graph for both, so that the difference of the two sides' coefficients is the transform of the
/// difference.
namespace tutti::consistency::internal {

inline constexpr int kScales = 4;
/// The rounding of poses on the wire (wire/codec.hpp): an error of its own at every node.
inline constexpr PoseSigma kRounding{5e-4, 1e-4};

/// Laplacian (eqs. 1, 2) of the chain's nodes by the graph's rule, with at most 32 nearest neighbours; of the carried
/// edges between them when the graph is reduced. Rows in the nodes' order.
spectral::SparseMatrix chain_laplacian(const ProxyGraph& graph, const ChainId& chain);

/// Takes the best-fitting small rigid motion out of displacements of fixed points. A motion that the points do not
/// determine (a turn about the line they all lie on) moves none of them.
class RigidMotion {
 public:
  explicit RigidMotion(std::span<const ProxyNode> nodes);
  /// n x 3, metres.
  void remove(Eigen::Ref<Eigen::MatrixX3d> displacements) const;

 private:
  Eigen::MatrixX3d arms_;  ///< From the centroid.
  Eigen::Matrix3d inverse_inertia_;
};

/// Less their mean: what is left of rotations, n x 3.
void remove_mean(Eigen::Ref<Eigen::MatrixX3d> rotations);

}  // namespace tutti::consistency::internal
