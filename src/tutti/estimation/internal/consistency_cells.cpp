// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/consistency_cells.hpp"

#include <algorithm>

namespace tutti::estimation::internal {
namespace {

std::vector<double> ways_of(const OdometryChain& chain, double place_m) {
  std::vector<double> ways{0.0};
  for (std::size_t k = 1; k < chain.T_odom_body.size(); ++k)
    ways.push_back(ways.back() +
                   (chain.T_odom_body[k].translation - chain.T_odom_body[k - 1].translation).norm() / place_m);
  return ways;
}

}  // namespace

int PlacePairs::count() const {
  std::set<Place> starts;
  std::set<Place> ends;
  int count = 0;
  for (const auto& [i, j] : pairs_) {
    if (starts.contains(i) || ends.contains(j)) continue;
    starts.insert(i);
    ends.insert(j);
    ++count;
  }
  return count;
}

ConsistencyCells::ConsistencyCells(std::span<const OdometryChain> chains, std::span<const LoopClosure> closures,
                                   const OdometryTrialConfig& config)
    : config_(config), graphs_(consistency_graphs(chains, closures, config.confidence)), cuts_(chains.size()) {
  for (const OdometryChain& chain : chains) ways_.push_back(ways_of(chain, config.place_m));
  for (std::size_t g = 0; g < graphs_.size(); ++g) divide(g);
}

void ConsistencyCells::set_cuts(std::size_t chain, std::vector<Cut> cuts) {
  cuts_[chain] = std::move(cuts);
  for (std::size_t g = 0; g < graphs_.size(); ++g)
    if (graphs_[g].first == chain || graphs_[g].second == chain) divide(g);
}

std::size_t ConsistencyCells::piece(std::size_t chain, std::size_t pose) const {
  return static_cast<std::size_t>(std::ranges::count_if(cuts_[chain], [&](const Cut& c) { return pose > c.from; }));
}

void ConsistencyCells::add(const Cell& cell, int vertex, PlacePairs& pairs) const {
  const PlacedClosure& closure = cell.closure(vertex);
  const auto place = [&](std::size_t chain, std::size_t pose) {
    return PlacePairs::Place{chain, static_cast<int>(std::min(way(chain, pose), 1e9))};
  };
  pairs.add(place(cell.graph->first, closure.i), place(cell.graph->second, closure.j));
}

void ConsistencyCells::divide(std::size_t g) {
  std::erase_if(cells_, [g](const auto& entry) { return std::get<0>(entry.first) == g; });
  const ConsistencyGraph& graph = graphs_[g];
  const auto within_cut = [&](std::size_t chain, std::size_t pose) {
    return std::ranges::any_of(cuts_[chain], [&](const Cut& c) { return pose > c.from && pose < c.to; });
  };
  for (std::size_t v = 0; v < graph.closures.size(); ++v) {
    const PlacedClosure& closure = graph.closures[v];
    if (within_cut(graph.first, closure.i) || within_cut(graph.second, closure.j)) continue;
    const std::size_t piece_i = piece(graph.first, closure.i);
    const std::size_t piece_j = piece(graph.second, closure.j);
    Cell& cell = cells_[{g, piece_i, piece_j}];
    cell.graph = &graph;
    cell.piece_i = piece_i;
    cell.piece_j = piece_j;
    cell.intact = graph.first == graph.second && piece_i == piece_j;
    cell.vertices.push_back(static_cast<int>(v));
  }
  for (auto& [key, cell] : cells_)
    if (std::get<0>(key) == g) find_cliques(cell);
}

/// The accepted clique is searched exactly, its rivals greedily, each among what the ones before it have left.
void ConsistencyCells::find_cliques(Cell& cell) const {
  constexpr std::size_t kCliques = 4;
  constexpr std::size_t kLeastRival = 2;
  std::vector<int> left = cell.vertices;
  while (cell.cliques.size() < kCliques && !left.empty()) {
    const bool accepted = cell.cliques.empty();
    std::vector<int> candidates = left;
    if (accepted && cell.intact) std::erase_if(candidates, [&](int v) { return !cell.closure(v).fits_odometry; });
    const auto clique =
        maximum_clique(induced(cell.graph->agreement, candidates), accepted ? config_.max_search_steps : 0);
    if (!accepted && clique.vertices.size() < kLeastRival) break;
    std::vector<int> members;
    for (const int k : clique.vertices) members.push_back(candidates[k]);
    std::erase_if(left, [&](int v) { return std::ranges::binary_search(members, v); });
    cell.cliques.push_back(std::move(members));
  }
  if (cell.intact || cell.cliques.size() < 2) return;
  // Corridors that look alike make the larger clique, but at one pair of places.
  const auto widest = std::ranges::max_element(cell.cliques, {}, [&](const std::vector<int>& clique) {
    PlacePairs pairs;
    for (const int v : clique) add(cell, v, pairs);
    return pairs.count();
  });
  std::swap(cell.cliques.front(), *widest);
}

}  // namespace tutti::estimation::internal
