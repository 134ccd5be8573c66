// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <utility>
#include <vector>

namespace tutti::estimation::internal {

/// Undirected graph on vertices 0 .. n-1: those next to v are neighbour[start[v]] .. neighbour[start[v + 1] - 1], each
/// edge at both ends; repeated edges do no harm.
struct Adjacency {
  std::vector<int> start{0};
  std::vector<int> neighbour;

  [[nodiscard]] int vertices() const { return static_cast<int>(start.size()) - 1; }
  [[nodiscard]] std::span<const int> of(int v) const {
    return std::span(neighbour).subspan(start[v], start[v + 1] - start[v]);
  }
};
Adjacency make_adjacency(int vertices, std::span<const std::pair<int, int>> edges);

/// Elimination order by nested dissection: a smallest level of a breadth-first search from a far end, such that neither
/// side holds more than two thirds, is eliminated last, and so on in what remains [George & Liu 1978, automatic nested
/// dissection]. Fills in more than minimum degree does, but the elimination tree is low: what lies above a vertex is a
/// few separators, not half of a long corridor.
std::vector<int> dissect(const Adjacency& graph);

}  // namespace tutti::estimation::internal
