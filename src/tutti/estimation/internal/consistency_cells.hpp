// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "tutti/estimation/internal/consistency_graph.hpp"
#include "tutti/estimation/odometry_trial.hpp"

namespace tutti::estimation::internal {

/// A stretch of a chain that is not believed: poses up to `from` lie before, from `to` on after it.
struct Cut {
  std::size_t from = 0;
  std::size_t to = 0;
  friend auto operator<=>(const Cut&, const Cut&) = default;
};

/// The closures between two pieces of odometry that hold. No loop of two closures of one cell runs over a cut.
struct Cell {
  const ConsistencyGraph* graph = nullptr;
  std::size_t piece_i = 0;  ///< Of graph->first, counted along the chain.
  std::size_t piece_j = 0;
  bool intact = false;                    ///< One piece: closures must fit the odometry between their ends.
  std::vector<int> vertices;              ///< Of the graph.
  std::vector<std::vector<int>> cliques;  ///< The accepted one first, then its rivals among the rest.

  [[nodiscard]] const PlacedClosure& closure(int vertex) const { return graph->closures[vertex]; }
};

/// Different pairs of places that some closures join, each place counted once. A place: of a chain, this far along.
class PlacePairs {
 public:
  using Place = std::pair<std::size_t, int>;
  void add(Place i, Place j) { pairs_.emplace(i, j); }
  [[nodiscard]] int count() const;

 private:
  std::set<std::pair<Place, Place>> pairs_;
};

/// All closures in their cells, for the cuts made so far.
class ConsistencyCells {
 public:
  ConsistencyCells(std::span<const OdometryChain> chains, std::span<const LoopClosure> closures,
                   const OdometryTrialConfig& config);
  ConsistencyCells(const ConsistencyCells&) = delete;  // cells point into it
  ConsistencyCells& operator=(const ConsistencyCells&) = delete;

  [[nodiscard]] const std::vector<Cut>& cuts(std::size_t chain) const { return cuts_[chain]; }
  /// In order. Closures that end within a cut belong to no cell.
  void set_cuts(std::size_t chain, std::vector<Cut> cuts);
  [[nodiscard]] std::size_t piece(std::size_t chain, std::size_t pose) const;

  using CellKey = std::tuple<std::size_t, std::size_t, std::size_t>;  ///< graph, piece of the first, of the second
  [[nodiscard]] const std::map<CellKey, Cell>& cells() const { return cells_; }
  void add(const Cell& cell, int vertex, PlacePairs& pairs) const;
  /// Way along a chain up to a pose, in places.
  [[nodiscard]] double way(std::size_t chain, std::size_t pose) const { return ways_[chain][pose]; }

 private:
  void divide(std::size_t graph);
  void find_cliques(Cell& cell) const;

  OdometryTrialConfig config_;
  std::vector<ConsistencyGraph> graphs_;
  std::vector<std::vector<double>> ways_;  // per chain
  std::vector<std::vector<Cut>> cuts_;     // per chain
  std::map<CellKey, Cell> cells_;
};

}  // namespace tutti::estimation::internal
