// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/graph.hpp"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <tuple>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/disjoint_sets.hpp"

namespace tutti::spectral {
namespace {

using Index = Eigen::Index;

/// Edges n - m with n < m, as they come.
using EdgeList = std::vector<WeightedEdge>;

SparseMatrix symmetric_from(int nodes, const EdgeList& edges) {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(2 * edges.size());
  for (const auto& edge : edges) {
    entries.emplace_back(edge.a, edge.b, edge.weight);
    entries.emplace_back(edge.b, edge.a, edge.weight);
  }
  SparseMatrix out(nodes, nodes);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

/// Positions as nanoflann's tree wants to see them.
struct Positions {
  std::span<const Eigen::Vector3d> points;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return points[i][static_cast<Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using KdTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Positions>, Positions, 3, int>;

/// nanoflann result set: all points nearer than a radius, in the tree's order. Its own one has another type of results
/// from version 1.5 on.
class AllWithin {
 public:
  using DistanceType = double;
  explicit AllWithin(double squared_distance) : squared_distance_(squared_distance) {}
  bool addPoint(double, int index) {
    indices_.push_back(index);
    return true;
  }
  [[nodiscard]] double worstDist() const { return squared_distance_; }
  [[nodiscard]] bool full() const { return true; }
  [[nodiscard]] std::size_t size() const { return indices_.size(); }
  void sort() {}  ///< Asked for from 1.5 on.
  void clear() { indices_.clear(); }
  [[nodiscard]] const std::vector<int>& indices() const { return indices_; }

 private:
  double squared_distance_;
  std::vector<int> indices_;
};

/// Calls visit(n, m, distance) once for every pair n < m at most radius_m apart.
template <class Visit>
void for_each_close_pair(std::span<const Eigen::Vector3d> positions, double radius_m, const Visit& visit) {
  constexpr double kSlack = 1.0 + 1e-9;  // the tree finds what is nearer than its radius
  for (std::size_t n = 0; n < positions.size(); ++n)
    TUTTI_CHECK(positions[n].allFinite(), "node {} has a position that is not finite", n);
  if (positions.empty()) return;
  const Positions source{positions};
  const KdTree tree(3, source, {});
  AllWithin found(radius_m * radius_m * kSlack);
  for (int n = 0; n < static_cast<int>(positions.size()); ++n) {
    const Eigen::Vector3d& position = positions[static_cast<std::size_t>(n)];
    found.clear();
    tree.findNeighbors(found, position.data(), {});
    for (const int m : found.indices()) {
      const double distance = (positions[static_cast<std::size_t>(m)] - position).norm();
      if (n < m && distance <= radius_m) visit(n, m, distance);
    }
  }
}

double proximity_weight(double distance_m, double sigma_m) {
  return std::exp(-distance_m / (2.0 * sigma_m * sigma_m));  // eq. (1)
}

/// Keeps edges, whose weight is their length, that are among the `most` shortest of either end.
void keep_nearest(std::size_t nodes, std::size_t most, EdgeList& edges) {
  struct Neighbour {
    double distance_m;
    int node;
    std::size_t edge;
  };
  std::vector<std::vector<Neighbour>> neighbours(nodes);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    neighbours[static_cast<std::size_t>(edges[e].a)].push_back({edges[e].weight, edges[e].b, e});
    neighbours[static_cast<std::size_t>(edges[e].b)].push_back({edges[e].weight, edges[e].a, e});
  }
  std::vector<bool> kept(edges.size(), false);
  for (auto& list : neighbours) {
    if (list.size() > most)
      std::nth_element(list.begin(), list.begin() + static_cast<std::ptrdiff_t>(most), list.end(),
                       [](const Neighbour& a, const Neighbour& b) {
                         return std::tie(a.distance_m, a.node) < std::tie(b.distance_m, b.node);
                       });
    for (std::size_t k = 0; k < std::min(most, list.size()); ++k) kept[list[k].edge] = true;
  }
  std::size_t next = 0;
  std::erase_if(edges, [&](const WeightedEdge&) { return !kept[next++]; });
}

}  // namespace

SparseMatrix proximity_adjacency(std::span<const Eigen::Vector3d> positions, double radius_m, double sigma_m,
                                 int most_neighbours) {
  TUTTI_CHECK(radius_m > 0.0 && sigma_m > 0.0, "radius {} m, sigma {} m", radius_m, sigma_m);
  EdgeList edges;  // weights are distances at first
  edges.reserve(positions.size() * 16);
  for_each_close_pair(positions, radius_m, [&](int n, int m, double distance) { edges.push_back({n, m, distance}); });
  if (most_neighbours > 0) keep_nearest(positions.size(), static_cast<std::size_t>(most_neighbours), edges);
  for (WeightedEdge& edge : edges) edge.weight = proximity_weight(edge.weight, sigma_m);
  std::erase_if(edges, [](const WeightedEdge& edge) { return !(edge.weight > 0.0); });
  return symmetric_from(static_cast<int>(positions.size()), edges);
}

SparseMatrix adjacency_from_edges(int nodes, std::span<const WeightedEdge> edges) {
  EdgeList sorted(edges.begin(), edges.end());
  for (auto& edge : sorted) {
    TUTTI_CHECK(std::min(edge.a, edge.b) >= 0 && std::max(edge.a, edge.b) < nodes && edge.a != edge.b,
                "edge {} - {} in a graph of {} nodes", edge.a, edge.b, nodes);
    TUTTI_CHECK(std::isfinite(edge.weight) && edge.weight > 0.0, "edge {} - {} has weight {}", edge.a, edge.b,
                edge.weight);
    if (edge.a > edge.b) std::swap(edge.a, edge.b);
  }
  // By weight too, so that the sum over parallel edges does not depend on their order.
  std::sort(sorted.begin(), sorted.end(), [](const WeightedEdge& p, const WeightedEdge& q) {
    return std::tie(p.a, p.b, p.weight) < std::tie(q.a, q.b, q.weight);
  });
  EdgeList merged;
  for (const auto& edge : sorted) {
    if (!merged.empty() && merged.back().a == edge.a && merged.back().b == edge.b)
      merged.back().weight += edge.weight;
    else
      merged.push_back(edge);
  }
  return symmetric_from(nodes, merged);
}

SparseMatrix laplacian(const SparseMatrix& adjacency) {
  TUTTI_CHECK(adjacency.rows() == adjacency.cols(), "adjacency is {} x {}", adjacency.rows(), adjacency.cols());
  SparseMatrix degrees(adjacency.rows(), adjacency.cols());
  degrees.setIdentity();
  degrees.diagonal() = adjacency * Eigen::VectorXd::Ones(adjacency.cols());
  return degrees - adjacency;  // eq. (2)
}

Components connected_components(const SparseMatrix& graph) {
  DisjointSets sets(static_cast<std::size_t>(graph.cols()));
  for (Eigen::Index node = 0; node < graph.cols(); ++node)
    for (SparseMatrix::InnerIterator it(graph, node); it; ++it)
      if (it.value() != 0.0) sets.join(static_cast<std::size_t>(it.row()), static_cast<std::size_t>(node));
  auto [label, count] = sets.labels();
  return {std::move(label), count};
}

}  // namespace tutti::spectral
