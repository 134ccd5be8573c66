// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/chain_filter.hpp"

#include <Eigen/Geometry>
#include <vector>

#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::consistency::internal {
namespace {

constexpr int kMostNeighbours = 32;
/// Turns about axes with less than this share of the largest moment of inertia move nothing and are ignored.
constexpr double kSmallestInertiaShare = 1e-12;

}  // namespace

spectral::SparseMatrix chain_laplacian(const ProxyGraph& graph, const ChainId& chain) {
  const std::span<const ProxyNode> nodes = nodes_of(graph, chain);
  if (graph.reduced) {
    const auto first = static_cast<std::uint32_t>(nodes.data() - graph.nodes.data());
    const auto end = first + static_cast<std::uint32_t>(nodes.size());
    std::vector<spectral::WeightedEdge> edges;
    for (const ProxyEdge& edge : graph.edges)
      if (edge.a >= first && edge.a < end && edge.b >= first && edge.b < end && edge.weight > 0.0)
        edges.push_back({static_cast<int>(edge.a - first), static_cast<int>(edge.b - first), edge.weight});
    return spectral::laplacian(spectral::adjacency_from_edges(static_cast<int>(nodes.size()), edges));
  }
  std::vector<Eigen::Vector3d> positions;
  for (const ProxyNode& node : nodes) positions.push_back(node.T_world_body.translation);
  return spectral::laplacian(spectral::proximity_adjacency(positions, graph.radius_m, graph.sigma_m, kMostNeighbours));
}

RigidMotion::RigidMotion(std::span<const ProxyNode> nodes) : arms_(static_cast<Eigen::Index>(nodes.size()), 3) {
  for (std::size_t k = 0; k < nodes.size(); ++k)
    arms_.row(static_cast<Eigen::Index>(k)) = nodes[k].T_world_body.translation.transpose();
  remove_mean(arms_);
  const Eigen::Matrix3d scatter = arms_.transpose() * arms_;
  const Eigen::Matrix3d tensor = scatter.trace() * Eigen::Matrix3d::Identity() - scatter;
  const Eigen3 inertia = eigen_of(tensor);
  const double smallest = kSmallestInertiaShare * inertia.values(2);
  const Eigen::Vector3d inverse =
      inertia.values.unaryExpr([&](double value) { return value > smallest ? 1.0 / value : 0.0; });
  inverse_inertia_ = inertia.vectors * inverse.asDiagonal() * inertia.vectors.transpose();
}

void RigidMotion::remove(Eigen::Ref<Eigen::MatrixX3d> displacements) const {
  remove_mean(displacements);
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (Eigen::Index k = 0; k < arms_.rows(); ++k)
    torque += Eigen::Vector3d(arms_.row(k)).cross(Eigen::Vector3d(displacements.row(k)));
  displacements -= arms_ * skew(inverse_inertia_ * torque).transpose();
}

void remove_mean(Eigen::Ref<Eigen::MatrixX3d> rotations) {
  if (rotations.rows() > 0) rotations.rowwise() -= Eigen::RowVector3d(rotations.colwise().mean());
}

}  // namespace tutti::consistency::internal
