// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"

namespace tutti::estimation {

/// A pose graph whose robust edges are taken in and out one by one, to see what each costs. Runs of trusted edges are
/// compounded once (chain_reduction.hpp), and all solutions share one symbolic factorisation.
class SwitchedGraph {
 public:
  /// `graph` must outlive this. `roles`: per edge. config.loss is not used.
  SwitchedGraph(const PoseGraph& graph, std::span<const EdgeRole> roles, const SolverConfig& config);
  ~SwitchedGraph();
  SwitchedGraph(const SwitchedGraph&) = delete;
  SwitchedGraph& operator=(const SwitchedGraph&) = delete;

  /// Least squares of the trusted edges and of the robust ones that are `in` (per edge of the graph; trusted edges are
  /// in whatever its value), from the last solution on, the first time as config.initialisation.
  Termination solve(const std::vector<char>& in);
  /// Solves the same factors from their measurements alone, too, and takes that solution if it costs less: a solution
  /// that others led to may lie in a basin of its own. True if it was taken. Only after solve().
  bool improve_from_measurements();
  /// Per edge what it makes the map pay at the last solution: by how much the least sum of r^T Omega r falls when the
  /// edge is taken out, or rises when it is taken in, to first order. With r the residual, C = J H^-1 J^T the
  /// covariance of the edge's relative pose in the map without the edge: r^T (Omega^-1 + C)^-1 r, chi-square of 6
  /// degrees of freedom if the edge and the map are right. Zero for trusted edges, and where the rest of the map does
  /// not determine it. An edge between two parts that nothing else joins has no price (infinity). Empty where the
  /// normal equations cannot be factorised: then nothing is known.
  [[nodiscard]] std::vector<double> prices();
  /// Poses of all nodes of the graph, at the last solution; as they were given, if there was none.
  [[nodiscard]] std::vector<Pose3> poses() const;
  [[nodiscard]] double cost() const;         ///< At the last solution, of what is in.
  [[nodiscard]] int factorisations() const;  ///< So far.

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tutti::estimation
