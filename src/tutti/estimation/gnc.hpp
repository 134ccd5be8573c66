// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"

namespace tutti::estimation {

struct GncConfig {
  SolverConfig solver;       ///< Its loss is not used.
  double confidence = 0.99;  ///< An inlier's r^T Omega r lies below the chi-square quantile (6 dof) with this chance.

  template <class V>
  void describe(V& v) {
    v.field("solver", solver, {}, "The weighted least-squares solver inside; its loss is not used.");
  }
};

struct GncResult {
  PoseGraphSolution solution;         ///< Optimum with the final weights; summary's costs are of the weighted problem.
  std::vector<double> inlier_weight;  ///< Per edge in [0, 1]; 1 for trusted edges; 0 and 1 once converged.
  int outer_iterations = 0;
};

/// Truncated least squares by graduated non-convexity: Yang, Antonante, Tzoumas, Carlone, "Graduated Non-Convexity for
/// Robust Spatial Perception", RA-L 2020: initial mu (remark 5), weights eq. (14), mu <- 1.4 mu.
/// Trusted edges must connect what they should: a component held together by robust edges alone may lose them all, and
/// the solver then keeps the parts where they are. `roles` empty: all robust.
GncResult solve_pose_graph_gnc(const PoseGraph& graph, const GncConfig& config, std::span<const EdgeRole> roles = {});

}  // namespace tutti::estimation
