// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/internal/gauss_newton.hpp"
#include "tutti/estimation/internal/odometry_runs.hpp"
#include "tutti/estimation/onboard_smoother.hpp"

namespace tutti::estimation::internal {

/// Positions in the chain of the reduced graph's nodes, increasing: the first pose and every constrained one.
std::vector<std::size_t> reduced_nodes(std::span<const ChainConstraint> constraints);

/// The constrained nodes of a chain, joined by runs and constraints.
struct ChainGraph {
  std::vector<std::size_t> nodes;
  PoseGraph graph;                 ///< Node k is nodes[k], composed from raw odometry; edge k run k, then constraints.
  std::vector<EdgeRole> roles;     ///< robust = doubtful.
  std::vector<std::size_t> edges;  ///< Of each constraint; of one with from == to: meaningless.
};
ChainGraph reduce(std::vector<std::size_t> nodes, std::span<const OdometryRun> runs,
                  std::span<const ChainConstraint> constraints, const Pose3& first);

/// A reduced graph with the analysis of its normal equations, kept from one update to the next.
class ReducedProblem {
 public:
  explicit ReducedProblem(ChainGraph graph);
  ReducedProblem(const ReducedProblem&) = delete;
  ReducedProblem& operator=(const ReducedProblem&) = delete;

  /// Takes over other measurements, information and roles; false, and nothing changed, when nodes or edges differ.
  bool assign(ChainGraph& graph);

  [[nodiscard]] const ChainGraph& reduced() const { return reduced_; }
  [[nodiscard]] GaussNewton& gauss_newton() { return gauss_newton_; }

 private:
  ChainGraph reduced_;
  BlockStructure structure_;
  GaussNewton gauss_newton_;
};

}  // namespace tutti::estimation::internal
