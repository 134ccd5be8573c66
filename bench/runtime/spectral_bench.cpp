// SPDX-License-Identifier: BSD-3-Clause
// One thread, 1600 nodes of a tunnel by default. Counters: max_error against the exact transform in metres, order of
// the polynomial, neighbours per node. Read the CPU column when the machine is shared.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "support/spectral/graphs.hpp"
#include "tutti/spectral/kron.hpp"
#include "tutti/spectral/wavelet_transform.hpp"

extern "C" {  // of the library that is really loaded
char* openblas_get_config();
void openblas_set_num_threads(int threads);
int openblas_get_num_threads();
}

namespace tutti::spectral {
namespace {

using Eigen::MatrixXd;
using Positions = std::vector<Eigen::Vector3d>;

constexpr double kRadius_m = 7.0;
constexpr double kSigma_m = 1.0;
constexpr int kScales = 7;

/// A run as the server believes it to be, and as a drifting robot does.
Positions server_run(benchmark::State& state) { return testing::tunnel(static_cast<int>(state.range(0)), 0.0, Rng(1)); }
Positions robot_run(benchmark::State& state) { return testing::tunnel(static_cast<int>(state.range(0)), 1.0, Rng(1)); }

SparseMatrix graph_of(const Positions& positions) {
  return laplacian(proximity_adjacency(positions, kRadius_m, kSigma_m));
}

double max_difference(const MatrixXd& a, const MatrixXd& b) { return (a - b).cwiseAbs().maxCoeff(); }

void BM_graph(benchmark::State& state) {
  const Positions positions = server_run(state);
  for (auto _ : state) benchmark::DoNotOptimize(graph_of(positions));
  const SparseMatrix L = graph_of(positions);
  state.counters["neighbours"] = static_cast<double>(L.nonZeros() - L.rows()) / static_cast<double>(L.rows());
}

void BM_largest_eigenpair(benchmark::State& state) {
  const SparseMatrix L = graph_of(server_run(state));
  for (auto _ : state) benchmark::DoNotOptimize(largest_eigenpair(L));
}

/// Everything exact: all eigenpairs, then the coefficients.
void BM_exact_transform(benchmark::State& state) {
  const Positions positions = server_run(state);
  const SparseMatrix L = graph_of(positions);
  const Eigen::VectorXd signal = testing::distance_signal(positions);
  for (auto _ : state) {
    const Spectrum spectrum = dense_spectrum(L);
    const MeyerFilterBank bank(kScales, spectrum.eigenvalues.tail<1>()[0]);
    benchmark::DoNotOptimize(exact_transform(spectrum, bank, signal));
  }
}

/// Argument 1: -log10 of the tolerance.
void BM_chebyshev_transform(benchmark::State& state) {
  const Positions positions = server_run(state);
  const SparseMatrix L = graph_of(positions);
  const Eigen::VectorXd signal = testing::distance_signal(positions);
  const MeyerFilterBank bank(kScales, largest_eigenvalue(L));
  const ChebyshevConfig config{.tolerance = std::pow(10.0, -static_cast<double>(state.range(1))), .max_order = 20000};
  ChebyshevResult result;
  for (auto _ : state) result = chebyshev_transform(L, bank, signal, config);
  state.counters["max_error"] = max_difference(result.coefficients, exact_transform(dense_spectrum(L), bank, signal));
  state.counters["bound"] = result.error_bound;
  state.counters["order"] = result.order;
}

/// The robot's whole comparison, from positions to |W - W'|, good to 1 mm: half of it for each graph.
struct Comparison {
  double lambda_max = 0.0;
  MatrixXd disagreement;
  int order = 0;
};

Comparison compare(const Positions& server, const Positions& robot) {
  const SparseMatrix L_server = graph_of(server);
  const SparseMatrix L_robot = graph_of(robot);
  Comparison out{.lambda_max = std::max(largest_eigenvalue(L_server), largest_eigenvalue(L_robot))};
  const MeyerFilterBank bank(kScales, out.lambda_max);
  const ChebyshevConfig config{.tolerance = 5e-4};
  const auto W_server = chebyshev_transform(L_server, bank, testing::distance_signal(server), config);
  const auto W_robot = chebyshev_transform(L_robot, bank, testing::distance_signal(robot), config);
  out.disagreement = (W_server.coefficients - W_robot.coefficients).cwiseAbs();  // eq. (8)
  out.order = std::max(W_server.order, W_robot.order);
  return out;
}

void BM_compare_two_graphs(benchmark::State& state) {
  const Positions server = server_run(state);
  const Positions robot = robot_run(state);
  Comparison comparison;
  for (auto _ : state) comparison = compare(server, robot);
  const MeyerFilterBank bank(kScales, comparison.lambda_max);
  const auto exact = [&](const Positions& p) {
    return exact_transform(dense_spectrum(graph_of(p)), bank, testing::distance_signal(p));
  };
  state.counters["max_error"] = max_difference(comparison.disagreement, (exact(server) - exact(robot)).cwiseAbs());
  state.counters["max_disagreement"] = comparison.disagreement.maxCoeff();
  state.counters["order"] = comparison.order;
}

/// One side of a comparison of a large graph, from positions to coefficients. Argument 1: 0 a tunnel, 1 an area that is
/// crossed in lanes.
void BM_large_graph(benchmark::State& state) {
  const int nodes = static_cast<int>(state.range(0));
  const bool is_area = state.range(1) != 0;
  const Positions positions = is_area ? testing::area(nodes, Rng(3)) : testing::tunnel(nodes, 0.0, Rng(1));
  const Eigen::VectorXd signal = testing::distance_signal(positions);
  ChebyshevResult result;
  double neighbours = 0.0;
  for (auto _ : state) {
    const SparseMatrix L = laplacian(proximity_adjacency(positions, is_area ? 4.0 : kRadius_m, kSigma_m));
    const double largest = largest_eigenvalue(L, kLargestEigenvalueTolerance);
    result = chebyshev_transform(L, MeyerFilterBank(kScales, largest), signal,
                                 {.tolerance = 5e-4, .largest_eigenvalue = largest});
    neighbours = static_cast<double>(L.nonZeros() - L.rows()) / static_cast<double>(L.rows());
  }
  state.counters["neighbours"] = neighbours;
  state.counters["order"] = result.order;
}

void BM_select_budget(benchmark::State& state) {
  const Positions positions = server_run(state);
  const SparseMatrix L = graph_of(positions);
  for (auto _ : state) benchmark::DoNotOptimize(select_budget(L, positions, static_cast<int>(L.rows()) / 2));
}

void BM_kron_reduce(benchmark::State& state) {
  const Positions positions = server_run(state);
  const SparseMatrix L = graph_of(positions);
  const auto keep = select_budget(L, positions, static_cast<int>(L.rows()) / 2);
  KronReduction reduction;
  for (auto _ : state) reduction = kron_reduce(L, keep);
  state.counters["edges_before"] = static_cast<double>(L.nonZeros() - L.rows()) / 2;
  state.counters["edges"] = static_cast<double>(reduction.laplacian.nonZeros() - reduction.laplacian.rows()) / 2;
  const SparseMatrix sparse = sparsify(reduction.laplacian, 1e-3);
  state.counters["edges_sparsified"] = static_cast<double>(sparse.nonZeros() - sparse.rows()) / 2;
}

BENCHMARK(BM_graph)->Arg(1600)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_largest_eigenpair)->Arg(1600)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_exact_transform)->Arg(400)->Arg(1600)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_chebyshev_transform)
    ->Args({1600, 1})
    ->Args({1600, 3})
    ->Args({1600, 5})
    ->Args({3200, 3})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(BM_compare_two_graphs)->Arg(1600)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_large_graph)
    ->ArgsProduct({{10'000, 100'000}, {0, 1}})
    ->Args({1'000'000, 0})
    ->Iterations(1)
    ->Unit(benchmark::kSecond);
BENCHMARK(BM_select_budget)->Arg(1600)->Unit(benchmark::kMillisecond);
BENCHMARK(BM_kron_reduce)->Arg(1600)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tutti::spectral

int main(int argc, char** argv) {
  openblas_set_num_threads(1);  // as OPENBLAS_NUM_THREADS=1 does
  benchmark::AddCustomContext("blas", openblas_get_config());
  benchmark::AddCustomContext("blas_threads", std::to_string(openblas_get_num_threads()));
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
