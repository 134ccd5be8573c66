// SPDX-License-Identifier: BSD-3-Clause
// Pose graphs from scratch, pairwise consistency, marginals. The results are printed beside the time. CPU time on
// one thread; run with OPENBLAS_NUM_THREADS=1. The onboard update has its own: onboard_speed.cpp.
#include <benchmark/benchmark.h>
#include <dlfcn.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tunnel_chain.hpp"
#include "tutti/base/random.hpp"
#include "tutti/estimation/marginals.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace {

using namespace tutti;
using namespace tutti::estimation;

void public_set(benchmark::State& state, const std::string& name, const SolverConfig& config) {
  const auto path = std::filesystem::path(TUTTI_SHARED_DIR) / "data/g2o" / name;
  const auto file = formats::read_g2o(path.string());
  if (!file) {
    state.SkipWithError(file.error().message.c_str());
    return;
  }
  PoseGraphSolution solution;
  for (auto _ : state) solution = solve_pose_graph(file->graph, config);
  state.counters["chi2"] = solution.summary.final_cost;
  state.counters["iterations"] = solution.summary.iterations;
}
BENCHMARK_CAPTURE(public_set, sphere2500, "sphere2500.g2o", {})->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(public_set, torus3D, "torus3D.g2o", {})->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(public_set, parking_garage, "parking-garage.g2o", {})->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(public_set, intel, "intel.g2o", {})->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(public_set, manhattan, "manhattan.g2o", {})->Unit(benchmark::kMillisecond);

/// 2,000 poses, 1,000 consecutive pairs, closures every few poses. `factor` is the time of the optimisation's setup and
/// one Gauss-Newton step for comparison.
PoseGraph revisiting_graph() {
  Rng rng(5);
  PoseGraph graph;
  for (std::size_t k = 0; k < 2000; ++k) {
    const double angle = 0.01 * M_PI * static_cast<double>(k);
    graph.poses.push_back({Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
                           {20.0 * std::cos(angle), 20.0 * std::sin(angle), 0.0}});
  }
  const auto link = [&](std::size_t a, std::size_t b) {
    const Pose3 exact = graph.poses[a].inverse() * graph.poses[b];
    graph.edges.push_back(
        {a, b, retract(exact, bench::noise(rng, 0.02, 0.005)), inverse_of(bench::covariance(0.02, 0.005))});
  };
  for (std::size_t k = 0; k + 1 < 2000; ++k) link(k, k + 1);
  for (std::size_t k = 0; k + 200 < 2000; k += 3) link(k, k + 200);
  return graph;
}

void marginals(benchmark::State& state) {
  const PoseGraph graph = revisiting_graph();
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t k = 0; k < 1000; ++k) pairs.emplace_back(2 * k, 2 * k + 1);
  std::vector<Matrix6d> covariances;
  for (auto _ : state) covariances = JointPosterior(graph, graph.poses, pairs).relative_covariances();
  state.counters["sigma_mm"] = 1e3 * std::sqrt(covariances[500](0, 0));
}
BENCHMARK(marginals)->Unit(benchmark::kMillisecond);

void marginals_compare_one_step(benchmark::State& state) {
  const PoseGraph graph = revisiting_graph();
  const SolverConfig config{.max_iterations = 1, .initialisation = "given"};
  for (auto _ : state) benchmark::DoNotOptimize(solve_pose_graph(graph, config));
}
BENCHMARK(marginals_compare_one_step)->Unit(benchmark::kMillisecond);

}  // namespace

int main(int argc, char** argv) {
  const auto config = reinterpret_cast<char* (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_config"));
  const auto threads = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_num_threads"));
  benchmark::AddCustomContext("blas", config != nullptr ? config() : "not OpenBLAS");
  benchmark::AddCustomContext("blas_threads", threads != nullptr ? std::to_string(threads()) : "unknown");
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
