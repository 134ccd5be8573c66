// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/doubt.hpp"

#include <algorithm>

namespace tutti::estimation::internal {
namespace {

/// A doubtful edge that raises the cost by at most this share of the loss's squared scale weighs at least 0.99.
constexpr double kUnnoticed = 0.01;

struct Candidate {
  std::vector<Pose3> poses;
  SolveSummary solve;
};

}  // namespace

DoubtingSummary minimise_doubting(GaussNewton& gauss_newton, std::span<const EdgeRole> roles, const RobustLoss& loss,
                                  const SolverConfig& config, const Continuation& how, std::vector<Pose3>& poses) {
  int iterations = 0;
  const auto minimise = [&](std::vector<Pose3> start, const EdgeCosts& costs) {
    Candidate out{.poses = std::move(start), .solve = {}};
    out.solve = gauss_newton.minimise(out.poses, costs, config, how);
    iterations += out.solve.iterations;
    return out;
  };
  const bool doubt = std::find(roles.begin(), roles.end(), EdgeRole::robust) != roles.end();
  std::vector<double> without(doubt ? roles.size() : 0, 1.0);
  for (std::size_t e = 0; e < without.size(); ++e)
    if (roles[e] == EdgeRole::robust) without[e] = 0.0;
  const Candidate trusted = minimise(poses, {.loss = {}, .roles = {}, .scale = without});
  Candidate best = trusted;
  bool applied = false;
  if (doubt && is_usable(trusted.solve.termination)) {
    const double scale2 = loss.scale * loss.scale;
    best = minimise(trusted.poses, {});
    if (best.solve.final_cost - trusted.solve.final_cost > kUnnoticed * scale2) {
      applied = true;
      const EdgeCosts robust{.loss = loss, .roles = roles, .scale = {}};
      best = minimise(std::move(best.poses), robust);
      // Where one edge weighs less than half, the cost is at least this; the other start cannot lead below.
      const double letting_go = trusted.solve.final_cost + loss.rho(scale2);
      if (best.solve.final_cost > letting_go)
        if (Candidate other = minimise(trusted.poses, robust); other.solve.final_cost < best.solve.final_cost)
          best = std::move(other);
    }
  }
  poses = std::move(best.poses);
  best.solve.initial_cost = trusted.solve.initial_cost;
  best.solve.iterations = iterations;
  return {.solve = best.solve, .loss_applied = applied};
}

}  // namespace tutti::estimation::internal
