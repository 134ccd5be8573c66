// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "tutti/estimation/internal/graph_equations.hpp"

namespace tutti::estimation::internal {

/// Moves `poses` to a minimum. Uses of config: iterations, tolerance, halvings. `step_tolerance`: converged only when,
/// beside the cost, no pose has farther to go than this (m, rad), by the rate at which the steps shrink.
SolveSummary minimise(GraphEquations& equations, std::vector<Pose3>& poses, const EdgeCosts& costs,
                      const SolverConfig& config, double step_tolerance = std::numeric_limits<double>::infinity());

}  // namespace tutti::estimation::internal
