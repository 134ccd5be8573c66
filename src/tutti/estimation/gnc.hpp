// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"

namespace tutti::estimation {

struct GncConfig {
  SolverConfig solver;       ///< Its loss is not used.
  double confidence = 0.99;  ///< Edges are truncated at this quantile of chi-square (6 degrees of freedom), below which
                             ///< an inlier's r^T Omega r lies with this probability.
};

struct GncResult {
  /// Optimum with the final weights; the summary's costs are those of the weighted problem.
  PoseGraphSolution solution;
  std::vector<double> inlier_weight;  ///< Per edge in [0, 1]; 1 for trusted edges; 0 and 1 once converged.
  int outer_iterations = 0;
};

/// Truncated least squares by graduated non-convexity: Yang, Antonante, Tzoumas, Carlone, "Graduated Non-Convexity for
/// Robust Spatial Perception", RA-L 2020: initial mu (remark 5), weights eq. (14), mu <- 2 mu. Runs of trusted edges
/// are compounded first (chain_reduction.hpp); the full graph is solved with the decided weights. `roles`: per edge, or
/// empty: all robust. Parts that robust edges alone join may lose all of these edges; each part then stays
/// where it is. Numerical failures are in the summary.
GncResult solve_pose_graph_gnc(const PoseGraph& graph, const GncConfig& config, std::span<const EdgeRole> roles = {});

}  // namespace tutti::estimation
