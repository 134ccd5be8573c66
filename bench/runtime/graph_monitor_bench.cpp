// SPDX-License-Identifier: BSD-3-Clause
// The server's cost of computing how sure it is of the shapes: time per proxy graph and bytes per broadcast, on a
// map of the size of the tunnel mission. `error` is the root mean square relative error of the sags against many
// samples; with deletions it also contains what hinges on one closure.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/server/corridor_run.hpp"
#include "tutti/estimation/marginals.hpp"
#include "tutti/server/graph_monitor.hpp"
#include "tutti/wire/codec.hpp"

namespace {

using namespace tutti;

/// Two robots walk a tunnel network for an hour: about 13,000 poses and 1,100 closures, a proxy node per 0.7 m.
server::MapEstimate tunnel_map() {
  server::test::CorridorRunConfig config;
  config.world = {.rows = 4, .columns = 5, .block_m = 30.0, .jitter_m = 6.0};
  config.walk = {.duration_s = 3600.0, .length_m = 1150.0, .rate_hz = 8.0, .min_speed_mps = 0.3, .max_speed_mps = 0.6};
  config.closures = {.radius_m = 2.5, .max_heading_deg = 60.0, .wrong_share = 0.0};
  config.keyframe_m = 0.16;
  const auto run = server::test::corridor_run(config, 1);
  server::MapEstimate map = server::estimate_map(run.submaps, run.verdicts, {});
  const MapNode* last = nullptr;
  for (MapNode& node : map.nodes) {
    node.representative = last == nullptr || last->id.chain != node.id.chain ||
                          (node.T_odom_body.translation - last->T_odom_body.translation).norm() >= 0.7;
    if (node.representative) last = &node;
  }
  return map;
}

const server::MapEstimate& map() {
  static const server::MapEstimate made = tunnel_map();
  return made;
}

std::vector<double> sigmas(const ProxyGraph& graph) {
  std::vector<double> out;
  for (const ChainUncertainty& uncertainty : graph.uncertainties)
    for (const ScaleUncertainty& scale : uncertainty.scales)
      for (const PoseSigma& sigma : scale.sigma) out.insert(out.end(), {sigma.position_m, sigma.rotation_rad});
  return out;
}

void monitor(benchmark::State& state) {
  const consistency::ProxyGraphConfig config{.shape_samples = static_cast<int>(state.range(0)),
                                             .shape_deletions = static_cast<int>(state.range(1))};
  ProxyGraph graph;
  map();
  for (auto _ : state) graph = server::monitor_graph(map(), 1, config);
  static const std::vector<double> reference =
      sigmas(server::monitor_graph(map(), 1, {.shape_samples = 2048, .shape_deletions = 0}));
  const std::vector<double> found = sigmas(graph);
  double squares = 0.0;
  for (std::size_t k = 0; k < found.size(); ++k) squares += std::pow(found[k] / reference[k] - 1.0, 2);
  state.counters["poses"] = static_cast<double>(map().nodes.size());
  state.counters["closures"] = static_cast<double>(map().graph.edges.size() - map().odometry_edges);
  state.counters["nodes"] = static_cast<double>(graph.nodes.size());
  state.counters["bytes"] = static_cast<double>(wire::encode(ProxyGraphMessage{{}, graph}).size());
  if (found.empty()) return;
  state.counters["error"] = std::sqrt(squares / static_cast<double>(found.size()));
  state.counters["expected_rmse_m"] = graph.uncertainties[0].whole.position_m;
}
BENCHMARK(monitor)
    ->ArgNames({"samples", "deletions"})
    ->Args({0, 0})
    ->Args({32, 0})
    ->Args({64, 0})
    ->Args({64, 32})
    ->Args({128, 0})
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
