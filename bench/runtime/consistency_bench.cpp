// SPDX-License-Identifier: BSD-3-Clause
// Comparing two tunnel graphs end to end: ProxyGraph + RobotNodes -> Comparison (both graphs, lambda_max, 7 scales on
// either side). Beside the time: the largest error against the exact transform, and the polynomial order.
#include <benchmark/benchmark.h>

#include "support/consistency/runs.hpp"
#include "tutti/consistency/compare.hpp"

namespace {

using namespace tutti;
using namespace tutti::consistency;

struct Scene {
  ProxyGraph graph;
  std::vector<RobotNode> nodes;
};

Scene scene_of(std::size_t length, int node_budget) {
  const Rng rng(1);
  const auto truth = test::tunnel(length);
  const auto increments = test::odometry_increments(truth, {}, rng.fork("odometry"));
  return {test::proxy_graph(test::server_estimate(truth, {}, rng.fork("server")), {.node_budget = node_budget}),
          test::robot_nodes(test::integrate({}, increments))};
}

void bm_compare(benchmark::State& state) {
  const Scene scene = scene_of(static_cast<std::size_t>(state.range(0)), static_cast<int>(state.range(1)));
  const CompareConfig config{.signal = state.range(2) == 0 ? "distance" : "relative_motion"};
  Comparison comparison;
  for (auto _ : state) {
    comparison = compare(scene.graph, test::kAlpha, scene.nodes, config);
    benchmark::DoNotOptimize(comparison.disagreement.data());
  }
  CompareConfig exact = config;
  exact.exact = true;
  const auto reference = compare(scene.graph, test::kAlpha, scene.nodes, exact);
  state.counters["max_error_m"] = (comparison.disagreement - reference.disagreement).cwiseAbs().maxCoeff();
  state.counters["largest_d_m"] = reference.disagreement.maxCoeff();
  state.counters["order"] = comparison.order;
  state.counters["lambda_max"] = comparison.lambda_max;
}
BENCHMARK(bm_compare)
    ->ArgNames({"nodes", "budget", "signal"})
    ->Args({400, 0, 0})
    ->Args({1600, 0, 0})
    ->Args({1600, 0, 1})
    ->Args({1600, 800, 0})
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
