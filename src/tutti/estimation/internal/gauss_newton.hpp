// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "tutti/estimation/internal/normal_equations.hpp"

namespace tutti::estimation::internal {

/// How one minimisation follows another.
struct Continuation {
  /// Converged only when, beside the cost, no pose has farther to go than this (m, rad), by the rate at which the steps
  /// shrink.
  double step_tolerance = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool limits_step() const { return step_tolerance < std::numeric_limits<double>::infinity(); }
};

/// Moves `poses` to a minimum. Uses of config: iterations, tolerance, halvings.
SolveSummary minimise(NormalEquations& equations, std::vector<Pose3>& poses, const EdgeCosts& costs,
                      const SolverConfig& config, const Continuation& how = {});

}  // namespace tutti::estimation::internal
