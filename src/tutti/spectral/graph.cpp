// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/graph.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "tutti/base/check.hpp"

namespace tutti::spectral {
namespace {

using Index = Eigen::Index;

/// Edges n - m with n < m, as they come.
using EdgeList = std::vector<WeightedEdge>;

/// Two counting passes: rows come out ascending in every column because the columns' entries arrive in row order.
SparseMatrix symmetric_from(int nodes, const EdgeList& edges) {
  std::vector<int> start(static_cast<std::size_t>(nodes) + 1, 0);
  for (const auto& edge : edges) {
    ++start[static_cast<std::size_t>(edge.a) + 1];
    ++start[static_cast<std::size_t>(edge.b) + 1];
  }
  for (std::size_t n = 0; n < static_cast<std::size_t>(nodes); ++n) start[n + 1] += start[n];
  std::vector<int> neighbour(edges.size() * 2);
  std::vector<double> weight(edges.size() * 2);
  std::vector<int> next(start.begin(), start.end() - 1);
  const auto append = [&](int from, int to, double w) {
    const auto slot = static_cast<std::size_t>(next[static_cast<std::size_t>(from)]++);
    neighbour[slot] = to;
    weight[slot] = w;
  };
  for (const auto& edge : edges) {
    append(edge.a, edge.b, edge.weight);
    append(edge.b, edge.a, edge.weight);
  }

  SparseMatrix out(nodes, nodes);
  out.resizeNonZeros(static_cast<Index>(neighbour.size()));
  std::copy(start.begin(), start.end(), out.outerIndexPtr());
  std::copy(start.begin(), start.end() - 1, next.begin());
  for (int row = 0; row < nodes; ++row) {
    for (int k = start[static_cast<std::size_t>(row)]; k < start[static_cast<std::size_t>(row) + 1]; ++k) {
      const int slot = next[static_cast<std::size_t>(neighbour[static_cast<std::size_t>(k)])]++;
      out.innerIndexPtr()[slot] = row;
      out.valuePtr()[slot] = weight[static_cast<std::size_t>(k)];
    }
  }
  return out;
}

/// Cell of a grid a hair wider than the radius (rounding must not put close nodes two cells apart), with the first node
/// in the middle of its cell (a level run then fills one layer). Cells far out are cut off to one, which costs time
/// only.
struct Cell {
  int x, y, z;
  friend auto operator<=>(const Cell&, const Cell&) = default;
};

Cell cell_of(const Eigen::Vector3d& position, const Eigen::Vector3d& first, double radius_m) {
  constexpr double kFarthest = 1e6;
  constexpr double kSlack = 1e-9;
  const Eigen::Array3d cell =
      ((position - first).array() / (radius_m * (1.0 + kSlack)) + 0.5).floor().max(-kFarthest).min(kFarthest);
  return {static_cast<int>(cell.x()), static_cast<int>(cell.y()), static_cast<int>(cell.z())};
}

struct Entry {
  Cell cell;
  int node;
};

/// Calls visit(n, m, distance) once for every pair at most radius_m apart.
template <class Visit>
void for_each_close_pair(std::span<const Eigen::Vector3d> positions, double radius_m, const Visit& visit) {
  std::vector<Entry> entries;
  entries.reserve(positions.size());
  for (const auto& position : positions) {
    TUTTI_CHECK(position.allFinite(), "node {} has a position that is not finite", entries.size());
    entries.push_back({cell_of(position, positions.front(), radius_m), static_cast<int>(entries.size())});
  }
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return std::tie(a.cell, a.node) < std::tie(b.cell, b.node); });
  const auto test = [&](const Entry& a, const Entry& b) {
    const double distance =
        (positions[static_cast<std::size_t>(a.node)] - positions[static_cast<std::size_t>(b.node)]).norm();
    if (distance <= radius_m) visit(std::min(a.node, b.node), std::max(a.node, b.node), distance);
  };

  const auto cell_before = [](const Entry& entry, const Cell& cell) { return entry.cell < cell; };
  const auto cell_after = [](const Cell& cell, const Entry& entry) { return cell < entry.cell; };
  for (auto first = entries.begin(); first != entries.end();) {
    const Cell cell = first->cell;
    const auto last = std::upper_bound(first, entries.end(), cell, cell_after);
    // Half of the neighbourhood: the cell itself and the next in z, then four columns of three cells each.
    const auto column_end = std::upper_bound(last, entries.end(), Cell{cell.x, cell.y, cell.z + 1}, cell_after);
    for (auto a = first; a != last; ++a)
      for (auto b = a + 1; b != column_end; ++b) test(*a, *b);
    for (const auto& [dx, dy] : {std::pair{0, 1}, {1, -1}, {1, 0}, {1, 1}}) {
      const auto from = std::lower_bound(last, entries.end(), Cell{cell.x + dx, cell.y + dy, cell.z - 1}, cell_before);
      const auto to = std::upper_bound(from, entries.end(), Cell{cell.x + dx, cell.y + dy, cell.z + 1}, cell_after);
      for (auto a = first; a != last; ++a)
        for (auto b = from; b != to; ++b) test(*a, *b);
    }
    first = last;
  }
}

double proximity_weight(double distance_m, double sigma_m) {
  return std::exp(-distance_m / (2.0 * sigma_m * sigma_m));  // eq. (1)
}

}  // namespace

SparseMatrix proximity_adjacency(std::span<const Eigen::Vector3d> positions, double radius_m, double sigma_m) {
  TUTTI_CHECK(radius_m > 0.0 && sigma_m > 0.0, "radius {} m, sigma {} m", radius_m, sigma_m);
  EdgeList edges;
  edges.reserve(positions.size() * 16);
  for_each_close_pair(positions, radius_m, [&](int n, int m, double distance) {
    const double weight = proximity_weight(distance, sigma_m);
    if (weight > 0.0) edges.push_back({n, m, weight});
  });
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
  const Index nodes = adjacency.rows();
  SparseMatrix out(nodes, nodes);
  out.reserve(adjacency.nonZeros() + nodes);
  for (Index n = 0; n < nodes; ++n) {
    double degree = 0.0;
    for (SparseMatrix::InnerIterator it(adjacency, n); it; ++it) degree += it.value();
    out.startVec(n);
    SparseMatrix::InnerIterator it(adjacency, n);
    for (; it && it.row() < n; ++it) out.insertBackByOuterInner(n, it.row()) = -it.value();
    out.insertBackByOuterInner(n, n) = degree;  // eq. (2)
    for (; it; ++it) out.insertBackByOuterInner(n, it.row()) = -it.value();
  }
  out.finalize();
  return out;
}

Components connected_components(const SparseMatrix& graph) {
  constexpr int kUnseen = -1;
  Components out{.label = std::vector<int>(static_cast<std::size_t>(graph.cols()), kUnseen)};
  std::vector<int> pending;
  for (int seed = 0; seed < static_cast<int>(graph.cols()); ++seed) {
    if (out.label[static_cast<std::size_t>(seed)] != kUnseen) continue;
    out.label[static_cast<std::size_t>(seed)] = out.count;
    pending.push_back(seed);
    while (!pending.empty()) {
      const int node = pending.back();
      pending.pop_back();
      for (SparseMatrix::InnerIterator it(graph, node); it; ++it) {
        auto& label = out.label[static_cast<std::size_t>(it.row())];
        if (it.value() == 0.0 || label != kUnseen) continue;
        label = out.count;
        pending.push_back(static_cast<int>(it.row()));
      }
    }
    ++out.count;
  }
  return out;
}

}  // namespace tutti::spectral
