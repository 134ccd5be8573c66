// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/estimation/internal/gauss_newton.hpp"

namespace tutti::estimation::internal {

struct DoubtingSummary {
  SolveSummary solve;         ///< Iterations of all phases; final cost with the loss, when it took part.
  bool loss_applied = false;  ///< False: every edge is trusted, and with the loss none would weigh less than 0.99.
};

/// Minimises with `loss` on the edges whose role is robust (the doubtful ones). A loss that lets go has several minima.
/// First the doubtful edges are left out; from there on every edge is trusted. Both are where the loss is started, and
/// the lower end counts: doubtful edges that contradict the rest are let go, unless they agree with each other and what
/// they contradict is cheaper to give up. Only the very first minimum depends on where `poses` start.
DoubtingSummary minimise_doubting(GaussNewton& gauss_newton, std::span<const EdgeRole> roles, const RobustLoss& loss,
                                  const SolverConfig& config, const Continuation& how, std::vector<Pose3>& poses);

}  // namespace tutti::estimation::internal
