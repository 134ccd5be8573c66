// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "tutti/estimation/internal/graph_equations.hpp"

namespace tutti::estimation::internal {

/// How minimise() goes about it, beside the config.
struct Minimising {
  /// Converged only when, beside the cost, no pose has farther to go than this (m, rad), by the rate at which the steps
  /// shrink.
  double step_tolerance = std::numeric_limits<double>::infinity();
  /// The equations are factorised, with other costs or at other poses: that factor is tried first, and kept as long as
  /// it makes steps shrink.
  bool is_factorised = false;
  std::function<bool()> stop;  ///< Asked before every step; once it is true none follows. Not set: never.
};

/// Moves `poses` to a minimum. Uses of config: iterations, tolerance, halvings.
SolveSummary minimise(GraphEquations& equations, std::vector<Pose3>& poses, const EdgeCosts& costs,
                      const SolverConfig& config, const Minimising& how = {});

}  // namespace tutti::estimation::internal
