// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>

#include "tutti/estimation/internal/reduced_problem.hpp"

namespace tutti::estimation::internal {

/// One Gauss-Newton step on the full graph of a chain, by eliminating the runs' inner poses about the current `poses`
/// (one per node of the chain; those after the last reduced node stay). False when singular: nothing changed.
bool full_step(ReducedProblem& problem, std::span<const RelativePose> odometry, std::span<Pose3> poses);

/// By how much the cost of the full graph is higher at `after` than at `before`: all odometry up to the last reduced
/// node, and the constraints.
double full_cost_change(const ReducedProblem& problem, std::span<const RelativePose> odometry,
                        std::span<const Pose3> before, std::span<const Pose3> after);

}  // namespace tutti::estimation::internal
