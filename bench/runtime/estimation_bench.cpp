// SPDX-License-Identifier: BSD-3-Clause
// Pose graphs from scratch, the onboard update, pairwise consistency, marginals. What was computed is printed beside
// the time: chi2, or the error against the full optimum. CPU time on one thread; run with OPENBLAS_NUM_THREADS=1.
#include <benchmark/benchmark.h>
#include <dlfcn.h>

#include <Eigen/LU>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/estimation/marginals.hpp"
#include "tutti/estimation/odometry_trial.hpp"
#include "tutti/estimation/onboard_smoother.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/formats/g2o.hpp"

namespace {

using namespace tutti;
using namespace tutti::estimation;

Vector6d noise(Rng& rng, double sigma_m, double sigma_rad) {
  Vector6d xi;
  for (int k = 0; k < 3; ++k) {
    xi[k] = rng.normal(sigma_m);
    xi[3 + k] = rng.normal(sigma_rad);
  }
  return xi;
}

Matrix6d covariance(double sigma_m, double sigma_rad) {
  Vector6d d;
  d << Eigen::Vector3d::Constant(sigma_m * sigma_m), Eigen::Vector3d::Constant(sigma_rad * sigma_rad);
  Matrix6d m = d.asDiagonal();
  m(0, 5) = m(5, 0) = 0.3 * sigma_m * sigma_rad;
  return m;
}

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

/// The paper's tunnel mission in size: 29,152 odometry steps of 4 cm, up and down a winding corridor, and relative
/// poses (1 mm, 1 mrad) between neighbouring constrained nodes and between passes at the same place.
struct Mission {
  std::vector<Pose3> truth{Pose3{}};
  std::vector<RelativePose> odometry;
  std::vector<ChainConstraint> constraints;
};

Mission tunnel_mission(std::size_t constraints, std::size_t nodes) {
  constexpr std::size_t kSteps = 29'152;
  Rng rng(7);
  Mission m;
  for (std::size_t k = 0; k < kSteps; ++k) {
    const double turn =
        k == kSteps / 2 ? M_PI : (k < kSteps / 2 ? 1.0 : -1.0) * 0.003 * std::sin(0.002 * static_cast<double>(k));
    Vector6d step;
    step << 0.041, 0.0, 0.0, rng.normal(1e-4), rng.normal(1e-4), turn;
    m.truth.push_back(retract(m.truth.back(), step));
    const Pose3 exact = m.truth[k].inverse() * m.truth[k + 1];
    m.odometry.push_back({retract(exact, noise(rng, 1e-3, 2e-4)), covariance(1e-3, 2e-4)});
  }
  const auto node = [&](std::size_t k) { return k * kSteps / nodes; };
  const auto link = [&](std::size_t a, std::size_t b) {
    const Pose3 exact = m.truth[a].inverse() * m.truth[b];
    m.constraints.push_back({a, b, {retract(exact, noise(rng, 1e-3, 1e-3)), covariance(1e-3, 1e-3)}});
  };
  for (std::size_t k = 0; k + 1 < nodes && m.constraints.size() < constraints; ++k) link(node(k), node(k + 1));
  for (std::size_t k = 0; m.constraints.size() < constraints; k = (k + 7) % (nodes / 2 - 2))
    link(node(k), node(nodes - 1 - k));
  return m;
}

OnboardSmoother smoother_of(const Mission& mission, int polishing_steps) {
  OnboardSmoother smoother(OnboardSmootherConfig{.polishing_steps = polishing_steps});
  for (const auto& step : mission.odometry) smoother.append(step);
  smoother.set_constraints(mission.constraints);
  return smoother;
}

void report_difference_from_optimum(benchmark::State& state, const Mission& mission, const std::vector<Pose3>& poses) {
  PoseGraph graph{.poses = poses, .edges = {}};
  for (std::size_t k = 0; k < mission.odometry.size(); ++k)
    graph.edges.push_back({k, k + 1, mission.odometry[k].T_a_b, mission.odometry[k].covariance.inverse()});
  for (const auto& c : mission.constraints)
    graph.edges.push_back({c.from, c.to, c.measurement.T_a_b, c.measurement.covariance.inverse()});
  const auto full = solve_pose_graph(graph, {.relative_cost_tolerance = 1e-14, .initialisation = "given"});
  double largest = 0.0;
  double sum = 0.0;
  for (std::size_t k = 0; k < poses.size(); ++k) {
    const double distance = (full.poses[k].translation - poses[k].translation).norm();
    largest = std::max(largest, distance);
    sum += distance * distance;
  }
  state.counters["max_mm"] = 1e3 * largest;
  state.counters["rms_mm"] = 1e3 * std::sqrt(sum / static_cast<double>(poses.size()));
}

/// One update with constraints never seen before: arguments constraints, constrained nodes, polishing steps.
void onboard_update(benchmark::State& state) {
  const auto mission =
      tunnel_mission(static_cast<std::size_t>(state.range(0)), static_cast<std::size_t>(state.range(1)));
  auto smoother = smoother_of(mission, static_cast<int>(state.range(2)));
  for (auto _ : state) {
    state.PauseTiming();
    auto fresh =
        OnboardSmoother(OnboardSmootherConfig{.polishing_steps = static_cast<int>(state.range(2))}, smoother.state());
    state.ResumeTiming();
    benchmark::DoNotOptimize(fresh.solve());
  }
  smoother.solve();
  report_difference_from_optimum(state, mission, smoother.poses());
}
BENCHMARK(onboard_update)
    ->ArgNames({"constraints", "nodes", "polish"})
    ->Args({746, 673, 0})
    ->Args({746, 673, 1})
    ->Args({2584, 1370, 0})
    ->Args({2584, 1370, 1})
    ->Unit(benchmark::kMillisecond);

/// The same when the runs between constrained nodes did not change.
void onboard_update_cached(benchmark::State& state) {
  const auto mission =
      tunnel_mission(static_cast<std::size_t>(state.range(0)), static_cast<std::size_t>(state.range(1)));
  auto smoother = smoother_of(mission, 0);
  smoother.solve();
  for (auto _ : state) benchmark::DoNotOptimize(smoother.solve());
  report_difference_from_optimum(state, mission, smoother.poses());
}
BENCHMARK(onboard_update_cached)
    ->ArgNames({"constraints", "nodes"})
    ->Args({746, 673})
    ->Args({2584, 1370})
    ->Unit(benchmark::kMillisecond);

void onboard_append(benchmark::State& state) {
  const RelativePose step{retract({}, Vector6d::Constant(0.01)), covariance(1e-3, 1e-3)};
  OnboardSmoother smoother;
  for (auto _ : state) benchmark::DoNotOptimize(smoother.append(step));
}
BENCHMARK(onboard_append)->Iterations(200'000);

/// Two robots on circles of 8 m with drift; half of the closures wrong by metres.
void odometry_trial(benchmark::State& state) {
  constexpr std::size_t kSteps = 1000;
  Rng rng(3);
  std::vector<OdometryChain> chains(2);
  std::vector<std::vector<Pose3>> truth(2);
  for (std::uint32_t robot = 0; robot < 2; ++robot) {
    chains[robot] = {.robot = {robot}, .first_index = 0, .T_odom_body = {Pose3{}}, .step_covariance = {}};
    for (std::size_t k = 0; k <= kSteps; ++k) {
      const double angle = 4.0 * M_PI * static_cast<double>(k) / kSteps + robot;
      truth[robot].push_back({Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
                              {8.0 * std::cos(angle), 8.0 * std::sin(angle), 0.0}});
    }
    for (std::size_t k = 0; k < kSteps; ++k) {
      const Pose3 step = retract(truth[robot][k].inverse() * truth[robot][k + 1], noise(rng, 0.01, 0.003));
      chains[robot].T_odom_body.push_back(chains[robot].T_odom_body.back() * step);
      chains[robot].step_covariance.push_back(covariance(0.01, 0.003));
    }
  }
  std::vector<LoopClosure> closures;
  for (std::int64_t k = 0; k < state.range(0); ++k) {
    const auto i = static_cast<std::size_t>(rng.index(kSteps));
    const auto j = static_cast<std::size_t>(rng.index(kSteps));
    Pose3 T = retract(truth[0][i].inverse() * truth[1][j], noise(rng, 0.03, 0.01));
    if (k % 2 == 1) T = retract(T, noise(rng, 3.0, 0.5));
    closures.push_back(
        {{{0}, static_cast<std::uint32_t>(i)}, {{1}, static_cast<std::uint32_t>(j)}, {T, covariance(0.03, 0.01)}});
  }
  OdometryVerdict result;
  for (auto _ : state) result = try_odometry(chains, closures, {});
  std::size_t right = 0;
  std::size_t wrong = 0;
  for (std::size_t k = 0; k < closures.size(); ++k) (k % 2 == 0 ? right : wrong) += result.accepted[k] ? 1 : 0;
  state.counters["right_of_half"] = static_cast<double>(right);
  state.counters["wrong"] = static_cast<double>(wrong);
}
BENCHMARK(odometry_trial)->ArgName("closures")->Arg(500)->Arg(1500)->Unit(benchmark::kMillisecond);

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
    graph.edges.push_back({a, b, retract(exact, noise(rng, 0.02, 0.005)), covariance(0.02, 0.005).inverse()});
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
  for (auto _ : state) covariances = relative_covariances(graph, graph.poses, pairs);
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
