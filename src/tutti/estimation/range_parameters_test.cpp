// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/range_parameters.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "support/estimation/random_graphs.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"

namespace tutti::estimation {
namespace range_parameters_test {

using testing::random_graph;
using testing::RandomGraph;

constexpr double kSigma_m = 0.05;

/// A chain with loops and ranges between its halves. Even ranges are longer by `even_m`, all by `trend_m` times a
/// number of their own.
struct World {
  RandomGraph chain;
  std::vector<GraphRange> ranges;
  std::vector<RangeParameter> parameters{2};
  std::vector<double> weights;

  World(std::uint64_t seed, double even_m, double trend_m, std::size_t wrong = 0) {
    Rng rng(seed);
    chain = random_graph(rng, 60, 20, 1.0);
    for (std::size_t k = 0; k < 200; ++k) {
      GraphRange of{.from = rng.index(30), .to = 30 + rng.index(30), .range = {}, .sigma_m = kSigma_m};
      of.range.p_i = {rng.normal(), rng.normal(), rng.normal()};
      const double by = rng.normal();
      const Eigen::Vector3d apart = chain.truth[of.from] * of.range.p_i - chain.truth[of.to] * of.range.p_j;
      of.range.distance_m = apart.norm() + rng.normal(kSigma_m) + trend_m * by + (k % 2 == 0 ? even_m : 0.0);
      if (k < wrong) of.range.distance_m += 50.0;
      if (k % 2 == 0) parameters[0].emplace_back(k, 1.0);
      parameters[1].emplace_back(k, by);
      ranges.push_back(of);
    }
    weights.assign(chain.graph.edges.size(), 1.0);
    for (std::size_t k = 0; k < ranges.size(); ++k) weights.push_back(k < wrong ? 0.0 : 1.0);
  }

  [[nodiscard]] std::vector<ParameterEstimate> missing() const {
    PoseGraph graph = chain.graph;
    for (int turn = 0; turn < 10; ++turn) {
      graph.edges.resize(chain.graph.edges.size());
      for (std::size_t k = 0; k < ranges.size(); ++k) {
        const GraphRange& of = ranges[k];
        graph.edges.push_back(
            range_edge(of.from, of.to, graph.poses[of.from], graph.poses[of.to], of.range, of.sigma_m));
        graph.edges.back().information *= std::max(1e-12, weights[chain.graph.edges.size() + k]);
      }
      graph.poses = solve_pose_graph(graph, {.initialisation = "given"}).poses;
    }
    return missing_parameters(graph, weights, ranges, parameters);
  }
};

TEST(RangeParameters, AreFoundWithinWhatTheyState) {
  double square = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto found = World(seed, 0.3, -0.1).missing();
    ASSERT_EQ(found.size(), 2U);
    EXPECT_LT(found[0].sigma, 0.03);
    square +=
        std::pow((found[0].value - 0.3) / found[0].sigma, 2) + std::pow((found[1].value + 0.1) / found[1].sigma, 2);
  }
  EXPECT_GT(square, 20.0);  // chi-square of 40 degrees
  EXPECT_LT(square, 70.0);
}

TEST(RangeParameters, RangesWithoutWeightSayNothing) {
  const auto found = World(3, 0.3, 0.0, 40).missing();
  EXPECT_NEAR(found[0].value, 0.3, 5.0 * found[0].sigma);
  EXPECT_NEAR(found[1].value, 0.0, 5.0 * found[1].sigma);
}

TEST(RangeParameters, WhatNoRangeDependsOnIsNotKnown) {
  World world(1, 0.3, 0.0);
  world.parameters.emplace_back();
  const auto found = world.missing();
  EXPECT_EQ(found[2].value, 0.0);
  EXPECT_GT(found[2].sigma, 100.0);
  EXPECT_NEAR(found[0].value, 0.3, 5.0 * found[0].sigma);
}

}  // namespace range_parameters_test
}  // namespace tutti::estimation
