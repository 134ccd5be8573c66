// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/kron.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/disjoint_sets.hpp"
#include "tutti/spectral/spectrum.hpp"

namespace tutti::spectral {
namespace {

std::size_t at(int n) { return static_cast<std::size_t>(n); }

std::vector<char> mask_of(int nodes, std::span<const int> chosen) {
  std::vector<char> mask(at(nodes), 0);
  for (const int node : chosen) {
    TUTTI_CHECK(node >= 0 && node < nodes, "node {} of {}", node, nodes);
    mask[at(node)] = 1;
  }
  return mask;
}

std::vector<int> nodes_of(const std::vector<char>& mask) {
  std::vector<int> out;
  for (std::size_t n = 0; n < mask.size(); ++n)
    if (mask[n] != 0) out.push_back(static_cast<int>(n));
  return out;
}

/// Each undirected edge once, a < b.
std::vector<WeightedEdge> edges_of(const SparseMatrix& laplacian) {
  std::vector<WeightedEdge> out;
  out.reserve(at(static_cast<int>(laplacian.nonZeros()) / 2));
  for (int n = 0; n < static_cast<int>(laplacian.cols()); ++n) {
    for (SparseMatrix::InnerIterator it(laplacian, n); it && it.row() < n; ++it) {
      TUTTI_CHECK(it.value() <= 0.0, "Laplacian entry {}, {} is {}", it.row(), n, it.value());
      if (it.value() < 0.0) out.push_back({static_cast<int>(it.row()), n, -it.value()});
    }
  }
  return out;
}

struct Link {
  int node;
  double weight;
};
using Links = std::vector<Link>;  ///< Ascending by node.

/// Both lists as one, without `left_out`; weights of common nodes add up.
Links merge(const Links& a, const Links& b, int left_out) {
  Links out;
  out.reserve(a.size() + b.size());
  for (auto p = a.begin(), q = b.begin(); p != a.end() || q != b.end();) {
    if (q == b.end() || (p != a.end() && p->node < q->node)) {
      if (p->node != left_out) out.push_back(*p);
      ++p;
    } else if (p == a.end() || q->node < p->node) {
      out.push_back(*q++);
    } else {
      out.push_back({p->node, p->weight + q->weight});
      ++p, ++q;
    }
  }
  return out;
}

/// Removes one node: its star of edges w_i becomes the mesh w_i w_j / sum(w), one step of the Schur complement. Mesh
/// edges lost in the rounding of both ends' degrees are left out (else everything ends up connected to everything:
/// 320,000 edges instead of 57,000 for half of a tunnel's 1600 nodes), but never those to the strongest neighbour:
/// connected nodes stay connected.
void eliminate(int node, const Eigen::VectorXd& degree, std::vector<Links>& graph,
               std::set<std::pair<std::size_t, int>>& by_degree) {
  constexpr double kRounding = 1e-16;
  const Links star = std::move(graph[at(node)]);
  graph[at(node)].clear();
  double total = 0.0;
  for (const Link& link : star) total += link.weight;
  const auto strongest =
      std::max_element(star.begin(), star.end(), [](const Link& a, const Link& b) { return a.weight < b.weight; });
  Links mesh;
  for (const Link& link : star) {
    mesh.clear();
    for (const Link& other : star) {
      const double weight = link.weight * other.weight / total;
      const bool counts = weight > kRounding * std::min(degree[link.node], degree[other.node]) ||
                          link.node == strongest->node || other.node == strongest->node;
      if (other.node != link.node && weight > 0.0 && counts) mesh.push_back({other.node, weight});
    }
    Links& links = graph[at(link.node)];
    const bool waits = by_degree.erase({links.size(), link.node}) > 0;
    links = merge(links, mesh, node);
    if (waits) by_degree.insert({links.size(), link.node});
  }
}

}  // namespace

/// Node by node, fewest neighbours first. Unlike a sparse Cholesky factor of L_bb this takes only sums of positive
/// numbers, so every weight keeps nearly full relative accuracy, the result is a Laplacian by construction, and nothing
/// is singular.
KronReduction kron_reduce(const SparseMatrix& laplacian, std::span<const int> keep) {
  const int nodes = static_cast<int>(laplacian.cols());
  const std::vector<char> kept = mask_of(nodes, keep);
  std::vector<Links> graph(at(nodes));
  for (int n = 0; n < nodes; ++n) {
    for (SparseMatrix::InnerIterator it(laplacian, n); it; ++it) {
      TUTTI_CHECK(it.row() == n || it.value() <= 0.0, "Laplacian entry {}, {} is {}", it.row(), n, it.value());
      if (it.row() != n && it.value() < 0.0) graph[at(n)].push_back({static_cast<int>(it.row()), -it.value()});
    }
  }
  const Eigen::VectorXd degree = laplacian.diagonal();
  std::set<std::pair<std::size_t, int>> by_degree;
  for (int n = 0; n < nodes; ++n)
    if (kept[at(n)] == 0) by_degree.insert({graph[at(n)].size(), n});
  while (!by_degree.empty()) {
    const int node = by_degree.begin()->second;
    by_degree.erase(by_degree.begin());
    eliminate(node, degree, graph, by_degree);
  }

  KronReduction out{.kept = nodes_of(kept)};
  std::vector<int> place(at(nodes), 0);
  for (std::size_t k = 0; k < out.kept.size(); ++k) place[at(out.kept[k])] = static_cast<int>(k);
  std::vector<WeightedEdge> edges;
  for (const int node : out.kept) {
    for (const Link& link : graph[at(node)])
      if (link.node < node) edges.push_back({place[at(link.node)], place[at(node)], link.weight});
  }
  out.laplacian = spectral::laplacian(adjacency_from_edges(static_cast<int>(out.kept.size()), edges));  // eq. (2)
  return out;
}

SparseMatrix sparsify(const SparseMatrix& laplacian, double relative_threshold) {
  TUTTI_CHECK(relative_threshold >= 0.0, "relative_threshold = {}", relative_threshold);
  const int nodes = static_cast<int>(laplacian.cols());
  const Eigen::VectorXd degree = laplacian.diagonal();
  std::vector<WeightedEdge> edges = edges_of(laplacian);
  std::sort(edges.begin(), edges.end(), [](const WeightedEdge& p, const WeightedEdge& q) {
    return std::tuple(-p.weight, p.a, p.b) < std::tuple(-q.weight, q.a, q.b);
  });
  DisjointSets forest(at(nodes));
  std::vector<WeightedEdge> kept;
  for (const auto& edge : edges) {
    const bool joins = forest.join(at(edge.a), at(edge.b));
    if (joins || edge.weight >= relative_threshold * std::min(degree[edge.a], degree[edge.b])) kept.push_back(edge);
  }
  return spectral::laplacian(adjacency_from_edges(nodes, kept));
}

std::vector<int> select_largest_eigenvector(const SparseMatrix& laplacian, std::span<const int> must_keep,
                                            double noise_tolerance) {
  std::vector<char> mask = mask_of(static_cast<int>(laplacian.cols()), must_keep);
  constexpr double kTolerance = 1e-13;  // signs of small entries hang on it
  const Eigen::VectorXd u_max = largest_eigenpair(laplacian, kTolerance).vector;
  for (Eigen::Index n = 0; n < u_max.size(); ++n)
    if (u_max[n] >= -noise_tolerance) mask[static_cast<std::size_t>(n)] = 1;  // eq. (3)
  return nodes_of(mask);
}

/// Farthest-point sampling: the node with the widest gap to all chosen ones comes next, gap = distance in space times
/// degree, so that dense segments (revisited corridors) keep as large a share of their nodes as sparse ones. RMS
/// relative error of the 40 lowest eigenvalues up to scale, 1600-node tunnel to 800 / 400 / 200 nodes: 3.0 / 6.5 / 14.6
/// %; plain distance 4.7 / 8.9 / 17.0 %, random nodes 3.4 / 7.3 / 15.1 %, largest degrees 13 / 14 / 24 %. Nodes of a
/// component without any chosen node are infinitely far, so every component gets one before any gets two.
std::vector<int> select_budget(const SparseMatrix& laplacian, std::span<const Eigen::Vector3d> positions, int budget,
                               std::span<const int> must_keep) {
  const int nodes = static_cast<int>(laplacian.cols());
  TUTTI_CHECK(positions.size() == at(nodes), "{} positions, graph of {} nodes", positions.size(), nodes);
  const Components components = connected_components(laplacian);
  std::vector<int> component_size(at(components.count), 0);
  for (const int label : components.label) ++component_size[at(label)];
  const Eigen::VectorXd degree = laplacian.diagonal();
  std::vector<double> gap(at(nodes), std::numeric_limits<double>::infinity());  // squared
  const auto narrow_gaps_to = [&](int node) {
    for (int n = 0; n < nodes; ++n) {
      if (components.label[at(n)] != components.label[at(node)]) continue;
      const double distance = (positions[at(n)] - positions[at(node)]).squaredNorm();
      gap[at(n)] = std::min(gap[at(n)], distance * degree[n] * degree[n]);
    }
  };
  // Which of two nodes comes first: by what the nodes are; their number decides only at the very same place.
  const auto before = [&](int a, int b) {
    if (gap[at(a)] != gap[at(b)]) return gap[at(a)] > gap[at(b)];
    const auto key = [&](int n) {
      const auto& p = positions[at(n)];
      return std::tuple(-component_size[at(components.label[at(n)])], p.x(), p.y(), p.z(), n);
    };
    return key(a) < key(b);
  };

  std::vector<int> chosen = nodes_of(mask_of(nodes, must_keep));
  for (const int node : chosen) narrow_gaps_to(node);
  std::vector<int> rest;
  for (int n = 0; n < nodes; ++n)
    if (!std::binary_search(chosen.begin(), chosen.end(), n)) rest.push_back(n);
  while (static_cast<int>(chosen.size()) < std::min(budget, nodes)) {
    const auto widest = std::min_element(rest.begin(), rest.end(), before);
    chosen.push_back(*widest);
    *widest = rest.back();
    rest.pop_back();
    narrow_gaps_to(chosen.back());
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace tutti::spectral
