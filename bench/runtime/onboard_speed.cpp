// SPDX-License-Identifier: BSD-3-Clause
// The cost of the onboard update, against full solves of the same factors, with how right each is; Markdown, the tables
// of docs/results/speed.md. Times are CPU time of one thread. Usage, one core:
//   OPENBLAS_NUM_THREADS=1 taskset -c 0 bench_onboard_speed [repetitions=25]
#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>

#include "tunnel_chain.hpp"
#include "tutti/estimation/internal/gauss_newton.hpp"
#include "tutti/estimation/internal/reduced_chain.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#ifdef TUTTI_HAVE_CERES
#include "ceres_solve.hpp"
#include "tutti/geometry/symmetric.hpp"
#endif

namespace {

using namespace tutti;
using namespace tutti::estimation;
using bench::TunnelChain;

double thread_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

struct Times {
  double best = 0.0;
  double median = 0.0;
};

/// `prepare` before each run is not counted.
Times measure(int repetitions, const std::function<void()>& prepare, const std::function<void()>& run) {
  std::vector<double> all;
  for (int k = 0; k < repetitions; ++k) {
    prepare();
    const double start = thread_ms();
    run();
    all.push_back(thread_ms() - start);
  }
  std::sort(all.begin(), all.end());
  return {all.front(), all[all.size() / 2]};
}

struct Difference {
  double max_mm = 0.0;
  double rms_mm = 0.0;
};

Difference difference(const std::vector<Pose3>& a, const std::vector<Pose3>& b) {
  Difference out;
  for (std::size_t k = 0; k < a.size(); ++k) {
    const double mm = 1e3 * (a[k].translation - b[k].translation).norm();
    out.max_mm = std::max(out.max_mm, mm);
    out.rms_mm += mm * mm / static_cast<double>(a.size());
  }
  out.rms_mm = std::sqrt(out.rms_mm);
  return out;
}

PoseGraph full_graph(const TunnelChain& chain) {
  PoseGraph graph;
  graph.poses.push_back(chain.truth.front());
  for (std::size_t k = 0; k < chain.odometry.size(); ++k) {
    graph.poses.push_back(graph.poses.back() * chain.odometry[k].T_a_b);
    graph.edges.push_back({k, k + 1, chain.odometry[k].T_a_b, inverse_of(chain.odometry[k].covariance)});
  }
  for (const auto& c : chain.constraints)
    graph.edges.push_back({c.from, c.to, c.measurement.T_a_b, inverse_of(c.measurement.covariance)});
  return graph;
}

void update_from_scratch(const TunnelChain& chain, int repetitions) {
  const PoseGraph graph = full_graph(chain);
  PoseGraph near = graph;
  {
    OnboardSmoother smoother({.polishing_steps = 2}, chain.state());
    smoother.solve();
    near.poses = smoother.poses();
  }
  const std::vector<Pose3> optimum =
      solve_pose_graph(near, {.relative_cost_tolerance = 1e-14, .initialisation = "given"}).poses;

  std::vector<Pose3> poses;
  const Times full = measure(
      3, [] {},
      [&] { poses = solve_pose_graph(graph, {.relative_cost_tolerance = 1e-6, .initialisation = "given"}).poses; });
  const auto row = [&](const std::string& what, const Times& times) {
    const Difference off = difference(poses, optimum);
    fmt::print("| {} | {} | {:.2f} | {:.2f} | {:.1f} | {:.3f} | {:.3f} |\n", chain.constraints.size(), what, times.best,
               times.median, full.best / times.best, off.max_mm, off.rms_mm);
    std::fflush(stdout);
  };
#ifdef TUTTI_HAVE_CERES
  const std::vector<Pose3> own = poses;
  const Times ceres = measure(
      2, [] {}, [&] { poses = bench::solve_with_ceres(graph); });
  row("full graph, Ceres", ceres);
  poses = own;
#endif
  row("full graph, own Gauss-Newton", full);
  for (const int polishing : {1, 0}) {
    OnboardSmoother smoother;
    const Times times = measure(
        repetitions, [&] { smoother = OnboardSmoother({.polishing_steps = polishing}, chain.state()); },
        [&] { smoother.solve(); });
    poses = smoother.poses();
    row(polishing == 0 ? "onboard smoother" : "onboard smoother, one polishing step", times);
  }
}

enum class Batch { add, replace };

std::vector<ChainConstraint> with_batch(const TunnelChain& chain, std::vector<ChainConstraint> out, Batch batch,
                                        int count, Rng& rng) {
  for (int k = 0; k < count; ++k) {
    if (batch == Batch::add) {
      const auto a = static_cast<std::size_t>(rng.index(bench::kTunnelSteps - 500));
      out.push_back(chain.measured(rng, a, a + 50 + static_cast<std::size_t>(rng.index(400))));
    } else {
      ChainConstraint& c = out[rng.index(out.size())];
      c = chain.measured(rng, c.from, c.to);
    }
  }
  return out;
}

/// set_constraints() and solve() of a smoother that has solved the rest.
void batch_row(const TunnelChain& chain, int repetitions, Batch batch, int count) {
  const Rng seed(11);
  OnboardSmoother smoother;
  int k = 0;
  std::vector<ChainConstraint> constraints;
  const auto prepare = [&] {
    Rng rng = seed.fork(static_cast<std::uint64_t>(k++));
    smoother = OnboardSmoother({}, chain.state());
    smoother.solve();
    constraints = with_batch(chain, chain.constraints, batch, count, rng);
  };
  const Times times = measure(repetitions, prepare, [&] {
    smoother.set_constraints(std::move(constraints));
    smoother.solve();
  });
  OnboardSmoother fresh;
  const Times scratch = measure(
      repetitions, [&] { fresh = OnboardSmoother({}, smoother.state()); }, [&] { fresh.solve(); });
  const double off = difference(smoother.poses(), fresh.poses()).max_mm;
  fmt::print("| {} | {} {} | {:.2f} | {:.2f} | {:.2f} | {:.1f} | {:.4f} |\n", chain.constraints.size(),
             batch == Batch::add ? "add" : "replace", count, times.best, times.median, scratch.best,
             scratch.best / times.best, off);
  std::fflush(stdout);
}

void batches(const TunnelChain& chain, int repetitions) {
  for (const Batch batch : {Batch::add, Batch::replace})
    for (const int count : {1, 5, 25, 100}) batch_row(chain, repetitions, batch, count);
}

/// From no constraint to all of them, one update per batch, each returning all poses.
void arriving(const TunnelChain& chain) {
  for (const std::size_t batch : {1, 5, 25, 100}) {
    OnboardSmoother smoother({}, {chain.truth.front(), chain.odometry, {}});
    double total = 0.0;
    double worst = 0.0;
    std::size_t updates = 0;
    for (std::size_t known = batch; known < chain.constraints.size() + batch; known += batch, ++updates) {
      const auto end =
          chain.constraints.begin() + static_cast<std::ptrdiff_t>(std::min(known, chain.constraints.size()));
      std::vector<ChainConstraint> constraints(chain.constraints.begin(), end);
      const double start = thread_ms();
      smoother.set_constraints(std::move(constraints));
      smoother.solve();
      const double ms = thread_ms() - start;
      total += ms;
      worst = std::max(worst, ms);
    }
    OnboardSmoother fresh({}, smoother.state());
    fresh.solve();
    fmt::print("| {} | {} | {} | {:.2f} | {:.2f} | {:.2f} | {:.4f} |\n", chain.constraints.size(), batch, updates,
               total * 1e-3, total / static_cast<double>(updates), worst,
               difference(smoother.poses(), fresh.poses()).max_mm);
    std::fflush(stdout);
  }
}

/// The parts of one update from scratch, each alone.
void parts(const TunnelChain& chain, int repetitions) {
  using namespace estimation::internal;
  const auto row = [&](const std::string& what, const std::function<void()>& run) {
    const Times times = measure(
        repetitions, [] {}, run);
    fmt::print("| {} | {} | {:.2f} |\n", chain.constraints.size(), what, times.best);
  };
  const auto nodes = reduced_nodes(chain.constraints);
  std::vector<PoseGraphEdge> runs;
  row("compound all odometry", [&] {
    runs.clear();
    update_runs(nodes, chain.odometry, runs);
  });
  PoseGraph graph;
  row("build the reduced graph", [&] { graph = reduced_graph(nodes, runs, chain.constraints, chain.truth.front()); });
  row("order it", [&] {
    const auto structure = analyse_blocks(graph);
    const GraphEquations equations(graph, structure);
  });
  const auto structure = analyse_blocks(graph);
  GraphEquations equations(graph, structure);
  std::vector<Pose3> reduced = graph.poses;
  minimise(equations, reduced, {}, {});
  row("residuals and Jacobians", [&] { equations.linearise(reduced, {}, true); });
  row("Cholesky factor", [&] { (void)equations.factorise(); });
  Eigen::VectorXd b = Eigen::VectorXd::Ones(6 * static_cast<Eigen::Index>(nodes.size() - 1));
  row("solve with it", [&] { equations.solve(b); });
  LongList<Pose3> poses(std::vector<Pose3>(chain.truth.size(), chain.truth.front()));
  const LongList<RelativePose> odometry(chain.odometry);
  row("bend all inner poses", [&] { place(runs, reduced, odometry, poses); });
  row("polish", [&] { (void)polish(nodes, odometry, graph, equations, poses); });
}

void append_and_memory(int repetitions) {
  const RelativePose step{retract({}, Vector6d::Constant(0.01)), bench::covariance(1e-3, 1e-3)};
  constexpr int kSamples = 200'000;
  OnboardSmoother smoother;
  const Times append = measure(
      std::max(3, repetitions / 5), [&] { smoother = OnboardSmoother(); },
      [&] {
        for (int k = 0; k < kSamples; ++k) smoother.append(step);
      });
  fmt::print("- Appending an odometry sample, memory from the system included: {:.0f} ns best, {:.0f} ns median.\n",
             append.best * 1e6 / kSamples, append.median * 1e6 / kSamples);
  fmt::print("- Memory per odometry sample: {} bytes (pose {}, factor {}).\n", sizeof(Pose3) + sizeof(RelativePose),
             sizeof(Pose3), sizeof(RelativePose));
  const TunnelChain chain = bench::tunnel_chain(746, 673);
  OnboardSmoother live({}, chain.state());
  Rng rng(13);
  std::size_t before = 0;
  std::size_t most = 0;
  for (int update = 0; update < 200; ++update) {
    live.set_constraints(with_batch(chain, chain.constraints, update % 2 == 0 ? Batch::add : Batch::replace, 25, rng));
    live.solve();
    if (update == 9) before = mallinfo2().uordblks;
    if (update >= 9) most = std::max(most, mallinfo2().uordblks);
  }
  fmt::print(
      "- 200 updates, 25 of 746 constraints other each time: heap {:.2f} MB after the 10th, {:.2f} MB at most "
      "after any later one.\n",
      static_cast<double>(before) * 1e-6, static_cast<double>(most) * 1e-6);
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::atoi(argv[1]) : 25;
  if (repetitions < 1) return 2;
  const TunnelChain few = bench::tunnel_chain(12, 13);
  const TunnelChain paper = bench::tunnel_chain(746, 673);
  const TunnelChain every_node = bench::tunnel_chain(2584, 1370);
  fmt::print(
      "| constraints | {} odometry factors, all poses returned | best ms | median ms | full / this | max mm | "
      "rms mm |\n| --- | --- | --- | --- | --- | --- | --- |\n",
      bench::kTunnelSteps);
  for (const auto* chain : {&few, &paper, &every_node}) update_from_scratch(*chain, repetitions);
  fmt::print(
      "\n| constraints | batch | best ms | median ms | from scratch, best ms | ratio | off from "
      "scratch, mm |\n| --- | --- | --- | --- | --- | --- | --- |\n");
  for (const auto* chain : {&few, &paper, &every_node}) batches(*chain, repetitions);
  fmt::print(
      "\n| constraints | arriving by | updates | all s | mean ms | worst ms | off from scratch, mm |\n| --- | --- | "
      "--- | --- | --- | --- | --- |\n");
  for (const auto* chain : {&paper, &every_node}) arriving(*chain);
  fmt::print("\n| constraints | part of an update | best ms |\n| --- | --- | --- |\n");
  for (const auto* chain : {&paper, &every_node}) parts(*chain, repetitions);
  fmt::print("\n");
  append_and_memory(repetitions);
  return 0;
}
