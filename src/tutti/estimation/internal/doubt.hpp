// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/estimation/internal/gauss_newton.hpp"

namespace tutti::estimation::internal {

struct DoubtingSummary {
  SolveSummary solve;  ///< Iterations of all phases; initial cost without the doubtful edges, final cost with them.
  bool loss_applied = false;  ///< False: no edge is doubtful, all are trusted.
};

/// Minimises with `loss` on the edges whose role is robust (the doubtful ones). A loss that lets go has several minima.
/// First the doubtful edges are left out; the loss starts from there and takes in those near enough. If it lets any go
/// (weight below a half), it starts once more where all are trusted, and the lower end counts: edges that contradict
/// the rest are let go, unless they agree with each other and what they contradict is cheaper to give up. Only the very
/// first minimum depends on where `poses` start.
DoubtingSummary minimise_doubting(NormalEquations& equations, std::span<const EdgeRole> roles, const RobustLoss& loss,
                                  const SolverConfig& config, const Continuation& how, std::vector<Pose3>& poses);

}  // namespace tutti::estimation::internal
