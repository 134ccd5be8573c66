// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <vector>

#include "support/estimation/random_graphs.hpp"
#include "tutti/estimation/onboard_smoother.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/geometry/symmetric.hpp"

/// Odometry chains with constraints and known truth for the tests of the onboard smoother.
namespace tutti::estimation::testing {

struct Mission {
  std::vector<Pose3> truth;
  std::vector<RelativePose> odometry;
  std::vector<ChainConstraint> constraints;
};

/// A long walk at 4 cm a step with correlated odometry noise, and constraints between some of its nodes.
inline Mission mission(Rng& rng, std::size_t steps, std::size_t constraints, double sigma_m = 1e-3,
                       double sigma_rad = 3e-4) {
  Mission out{.truth = {random_pose(rng)}, .odometry = {}, .constraints = {}};
  for (std::size_t k = 0; k < steps; ++k) {
    Vector6d u;
    u << 0.04, 0.0, 0.0, rng.normal(0.002), rng.normal(0.002), rng.normal(0.01);
    const Matrix6d covariance = random_covariance(rng, sigma_m, sigma_rad);
    out.truth.push_back(retract(out.truth.back(), u));
    const Pose3 exact = out.truth[k].inverse() * out.truth[k + 1];
    out.odometry.push_back({retract(exact, sample(rng, covariance)), covariance});
  }
  for (std::size_t k = 0; k < constraints; ++k) {
    const auto a = static_cast<std::size_t>(rng.index(steps * 9 / 10));
    const auto b = static_cast<std::size_t>(rng.index(steps * 9 / 10));
    const Matrix6d covariance = random_covariance(rng, 2e-3, 1e-3);
    const Pose3 exact = out.truth[a].inverse() * out.truth[b];
    if (a != b) out.constraints.push_back({a, b, {retract(exact, sample(rng, covariance)), covariance}});
  }
  return out;
}

inline OnboardSmoother smoother_of(const Mission& mission, const OnboardSmootherConfig& config = {}) {
  OnboardSmoother smoother(config, mission.truth.front());
  for (const auto& step : mission.odometry) smoother.append(step);
  smoother.set_constraints(mission.constraints);
  return smoother;
}

/// The optimum of the full graph.
inline std::vector<Pose3> full_optimum(const Mission& mission, const std::vector<Pose3>& start) {
  PoseGraph graph{.poses = start, .edges = {}};
  for (std::size_t k = 0; k < mission.odometry.size(); ++k)
    graph.edges.push_back({k, k + 1, mission.odometry[k].T_a_b, inverse_of(mission.odometry[k].covariance)});
  for (const auto& c : mission.constraints)
    graph.edges.push_back({c.from, c.to, c.measurement.T_a_b, inverse_of(c.measurement.covariance)});
  const auto solution = solve_pose_graph(graph, {.relative_cost_tolerance = 1e-14, .initialisation = "given"});
  EXPECT_EQ(solution.summary.termination, Termination::converged);
  return solution.poses;
}

}  // namespace tutti::estimation::testing
