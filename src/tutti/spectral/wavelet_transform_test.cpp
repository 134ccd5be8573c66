// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/wavelet_transform.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "support/spectral/graphs.hpp"

namespace tutti::spectral {
namespace wavelet_transform_test {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd random_signals(int nodes, int count, Rng& rng) {
  return MatrixXd::NullaryExpr(nodes, count, [&] { return rng.uniform(-100.0, 100.0); });
}

SparseMatrix random_graph(int nodes, Rng& rng) {
  return testing::laplacian_of(nodes, testing::random_edges(nodes, *rc::gen::inRange(1, 4), rng));
}

RC_GTEST_PROP(ExactTransform, KeepsTheEnergyAndConstants, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(1, 60);
  const int scales = *rc::gen::inRange(1, 9);
  const Spectrum spectrum = dense_spectrum(random_graph(nodes, rng));
  const MeyerFilterBank bank(scales, spectrum.eigenvalues[nodes - 1]);
  const MatrixXd signals = random_signals(nodes, 2, rng);
  const MatrixXd coefficients = exact_transform(spectrum, bank, signals);
  RC_ASSERT(coefficients.cols() == 2 * scales);
  for (int c = 0; c < 2; ++c) {
    double energy = 0.0;
    for (int s = 0; s < scales; ++s) energy += coefficients.col(2 * s + c).squaredNorm();
    RC_ASSERT(std::abs(energy - signals.col(c).squaredNorm()) <= 1e-11 * (1.0 + energy));  // tight frame
  }
  const MatrixXd constant = exact_transform(spectrum, bank, VectorXd::Constant(nodes, 300.0));
  RC_ASSERT((constant.col(0).array() - 300.0).abs().maxCoeff() <= 1e-9);
  RC_ASSERT((scales == 1 || constant.rightCols(scales - 1).cwiseAbs().maxCoeff() <= 1e-9));
}

RC_GTEST_PROP(ChebyshevTransform, IsWithinTheToleranceAskedFor, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(1, 80);
  const int scales = *rc::gen::inRange(1, 8);
  const SparseMatrix L = random_graph(nodes, rng);
  const Spectrum spectrum = dense_spectrum(L);
  // A bank for this graph, for one with a larger, or for one with a smaller spectrum.
  const MeyerFilterBank bank(scales, spectrum.eigenvalues[nodes - 1] * *rc::gen::element(1.0, 1.0, 2.5, 0.6));
  const MatrixXd signals = random_signals(nodes, 3, rng);
  const MatrixXd exact = exact_transform(spectrum, bank, signals);
  const double tolerance = *rc::gen::element(10.0, 1.0, 0.1, 1e-2, 1e-4);
  const auto result = chebyshev_transform(L, bank, signals, {.tolerance = tolerance, .max_order = 100000});
  RC_ASSERT(result.converged);
  RC_ASSERT(result.error_bound <= tolerance);
  RC_ASSERT((result.coefficients - exact).cwiseAbs().maxCoeff() <= result.error_bound + 1e-10);
}

RC_GTEST_PROP(ChebyshevTransform, SaysSoWhenTheOrderIsTooSmall, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(20, 80);
  const SparseMatrix L = random_graph(nodes, rng);
  const Spectrum spectrum = dense_spectrum(L);
  const MeyerFilterBank bank(6, spectrum.eigenvalues[nodes - 1]);
  const MatrixXd signals = random_signals(nodes, 1, rng);
  const int max_order = *rc::gen::inRange(1, 60);
  const auto result = chebyshev_transform(L, bank, signals, {.tolerance = 1e-6, .max_order = max_order});
  RC_ASSERT(!result.converged);
  RC_ASSERT(result.order <= max_order);
  const double error = (result.coefficients - exact_transform(spectrum, bank, signals)).cwiseAbs().maxCoeff();
  RC_ASSERT(error <= result.error_bound);  // the bound holds all the same
}

RC_GTEST_PROP(ChebyshevTransform, CoefficientsMoveWithTheNodes, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(2, 60);
  const auto edges = testing::random_edges(nodes, 2, rng);
  const auto to = testing::random_permutation(nodes, rng);
  std::vector<WeightedEdge> moved_edges;
  for (const auto& e : edges)
    moved_edges.push_back({to[static_cast<std::size_t>(e.a)], to[static_cast<std::size_t>(e.b)], e.weight});
  const SparseMatrix L = testing::laplacian_of(nodes, edges);
  const SparseMatrix moved_L = testing::laplacian_of(nodes, moved_edges);
  const MatrixXd signal = random_signals(nodes, 1, rng);
  MatrixXd moved_signal(nodes, 1);
  for (int n = 0; n < nodes; ++n) moved_signal(to[static_cast<std::size_t>(n)], 0) = signal(n, 0);

  const MeyerFilterBank bank(7, largest_eigenvalue(L));
  const MatrixXd exact = exact_transform(dense_spectrum(L), bank, signal);
  const MatrixXd moved_exact = exact_transform(dense_spectrum(moved_L), bank, moved_signal);
  const ChebyshevConfig config{.tolerance = 1e-3, .max_order = 100000};
  const MatrixXd chebyshev = chebyshev_transform(L, bank, signal, config).coefficients;
  const MatrixXd moved_chebyshev = chebyshev_transform(moved_L, bank, moved_signal, config).coefficients;
  for (int n = 0; n < nodes; ++n) {
    const int m = to[static_cast<std::size_t>(n)];
    RC_ASSERT((exact.row(n) - moved_exact.row(m)).cwiseAbs().maxCoeff() <= 1e-10);
    RC_ASSERT((chebyshev.row(n) - moved_chebyshev.row(m)).cwiseAbs().maxCoeff() <= 1e-10);
  }
}

TEST(ChebyshevTransform, TheOrderFollowsTheSignal) {
  // As large as each other, but only the rough signal has energy where polynomials of small degree are still wrong.
  const SparseMatrix L = testing::path(300);
  const Spectrum spectrum = dense_spectrum(L);
  const MeyerFilterBank bank(7, spectrum.eigenvalues[299]);
  const ChebyshevConfig config{.tolerance = 1e-3, .max_order = 20000};
  const auto smooth = chebyshev_transform(L, bank, 1e3 * spectrum.eigenvectors.col(2), config);
  const auto rough = chebyshev_transform(L, bank, 1e3 * spectrum.eigenvectors.col(30), config);
  EXPECT_TRUE(smooth.converged);
  EXPECT_TRUE(rough.converged);
  EXPECT_LT(3 * smooth.order, rough.order);
}

TEST(ChebyshevTransform, ConstantsPerComponentPassExactly) {
  const SparseMatrix L = testing::laplacian_of(6, {{0, 1, 1.0}, {1, 2, 2.0}, {3, 4, 0.5}});  // node 5 is isolated
  const VectorXd signal = (VectorXd(6) << 7, 7, 7, -300, -300, 1e6).finished();
  const auto result = chebyshev_transform(L, MeyerFilterBank(4, 5.0), signal);
  EXPECT_EQ(result.coefficients.col(0), signal);
  EXPECT_EQ(result.coefficients.rightCols(3), MatrixXd::Zero(6, 3));
  EXPECT_TRUE(result.converged);
  EXPECT_EQ(result.error_bound, 0.0);
}

TEST(ChebyshevTransform, TunnelOfSeveralTolerances) {
  const auto positions = testing::tunnel(400, 1.0, Rng(3));
  const SparseMatrix L = laplacian(proximity_adjacency(positions, 7.0, 1.0));
  const VectorXd signal = testing::distance_signal(positions);
  const MeyerFilterBank bank(7, largest_eigenvalue(L));
  const MatrixXd exact = exact_transform(dense_spectrum(L), bank, signal);
  int order = 0;
  for (const double tolerance : {1.0, 1e-2, 1e-4}) {
    const auto result = chebyshev_transform(L, bank, signal, {.tolerance = tolerance, .max_order = 20000});
    EXPECT_TRUE(result.converged);
    EXPECT_LE((result.coefficients - exact).cwiseAbs().maxCoeff(), tolerance);
    EXPECT_GT(result.order, order);
    order = result.order;
  }
}

RC_GTEST_PROP(WaveletFilter, NoKernelIsOffByMoreThanTheTolerance, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(2, 60);
  const SparseMatrix L = random_graph(nodes, rng);
  const Spectrum spectrum = dense_spectrum(L);
  const double tolerance = *rc::gen::element(0.1, 0.01, 1e-3);
  const WaveletFilter filter(L, *rc::gen::inRange(2, 8), tolerance);
  const MeyerFilterBank& bank = filter.bank();
  const double lambda_max = spectrum.eigenvalues[nodes - 1];
  RC_ASSERT(bank.lambda_max() >= lambda_max * (1.0 - 1e-12));
  RC_ASSERT(bank.lambda_max() <= 1.02 * lambda_max);
  // Every wave of the graph by itself, so that the coefficient is the kernel, and less so near zero.
  const MatrixXd off = filter(spectrum.eigenvectors) - exact_transform(spectrum, bank, spectrum.eigenvectors);
  for (int s = 0; s < bank.scales(); ++s)
    for (int k = 0; k < nodes; ++k) {
      const double share = lambda_max > 0.0 ? std::max(0.0, spectrum.eigenvalues[k]) / lambda_max : 0.0;
      RC_ASSERT(off.col(s * nodes + k).norm() <= tolerance * share * (1.0 + 1e-6) + 1e-10);
    }
}

TEST(WaveletFilter, TunnelAtTheDefaultTolerance) {
  const auto positions = testing::tunnel(400, 1.0, Rng(3));
  const SparseMatrix L = laplacian(proximity_adjacency(positions, 7.0, 1.0));
  const VectorXd signal = testing::distance_signal(positions);
  const VectorXd deviation = signal.array() - signal.mean();
  const Spectrum spectrum = dense_spectrum(L);
  int degree = 0;
  for (const double tolerance : {0.1, 0.01, 1e-3}) {
    const WaveletFilter filter(L, 4, tolerance);
    const MatrixXd off = filter(signal) - exact_transform(spectrum, filter.bank(), signal);
    EXPECT_LE(off.colwise().norm().maxCoeff(), tolerance * deviation.norm());
    EXPECT_GT(filter.degree(), degree);
    degree = filter.degree();
  }
  EXPECT_LT(WaveletFilter(L, 4).degree(), 60);
}

TEST(WaveletFilter, ConstantsPerComponentPassExactly) {
  const SparseMatrix L = testing::laplacian_of(6, {{0, 1, 1.0}, {1, 2, 2.0}, {3, 4, 0.5}});  // node 5 is isolated
  const VectorXd signal = (VectorXd(6) << 7, 7, 7, -300, -300, 1e6).finished();
  const MatrixXd coefficients = WaveletFilter(L, 4)(signal);
  EXPECT_EQ(coefficients.col(0), signal);
  EXPECT_EQ(coefficients.rightCols(3), MatrixXd::Zero(6, 3));
}

// A statement on samples of an error holds for the error only if the filter does not depend on what it filters.
TEST(WaveletFilter, IsOneLinearMapWhateverTheSignal) {
  Rng rng(11);
  const SparseMatrix L = laplacian(proximity_adjacency(testing::tunnel(150, 1.0, Rng(5)), 7.0, 1.0));
  const WaveletFilter filter(L, 5);
  const MatrixXd f = random_signals(150, 3, rng);
  const MatrixXd W = filter(f);
  ASSERT_EQ(W.cols(), 15);
  for (int c = 0; c < 3; ++c) {
    const MatrixXd alone = filter(f.col(c));
    for (int s = 0; s < 5; ++s) EXPECT_EQ(alone.col(s), W.col(3 * s + c));
  }
  const MatrixXd mixed = filter(2.0 * f.col(0) - 1e-5 * f.col(1));
  for (int s = 0; s < 5; ++s)
    EXPECT_LT((mixed.col(s) - 2.0 * W.col(3 * s) + 1e-5 * W.col(3 * s + 1)).norm(), 1e-11 * f.norm());
}

// Twenty samples: more than are filtered at a time, and not a multiple of that.
TEST(WaveletFilter, ScatterIsThatOfTheCoefficients) {
  Rng rng(12);
  const SparseMatrix L = laplacian(proximity_adjacency(testing::tunnel(150, 1.0, Rng(5)), 7.0, 1.0));
  const WaveletFilter filter(L, 4);
  const MatrixXd samples = random_signals(150, 60, rng);
  const MatrixXd W = filter(samples);
  const std::vector<MatrixXd> scatter = filter.scatter(samples);
  ASSERT_EQ(scatter.size(), 4U);
  for (int s = 0; s < 4; ++s) {
    MatrixXd expected = MatrixXd::Zero(150, 6);
    for (int k = 60 * s; k < 60 * (s + 1); k += 3)
      for (int i = 0, c = 0; i < 3; ++i)
        for (int j = 0; j <= i; ++j, ++c) expected.col(c) += W.col(k + i).cwiseProduct(W.col(k + j));
    EXPECT_LT((scatter[static_cast<std::size_t>(s)] - expected).norm(), 1e-5 * expected.norm()) << s;
  }
  const WaveletFilter none(SparseMatrix(0, 0), 3);
  EXPECT_EQ(none.scatter(MatrixXd(0, 6)).size(), 3U);
  EXPECT_THROW((void)filter.scatter(MatrixXd(150, 4)), std::logic_error);
}

TEST(WaveletFilter, SmallestGraphs) {
  EXPECT_EQ(WaveletFilter(SparseMatrix(0, 0), 3)(MatrixXd(0, 2)).cols(), 6);
  const WaveletFilter one(testing::laplacian_of(1, {}), 3);
  EXPECT_EQ(one.degree(), 0);
  EXPECT_EQ(one(MatrixXd::Constant(1, 1, 5.0)), (MatrixXd(1, 3) << 5, 0, 0).finished());
  EXPECT_EQ(one(MatrixXd(1, 0)).cols(), 0);
  EXPECT_THROW((void)one(MatrixXd(2, 1)), std::logic_error);
  EXPECT_THROW(WaveletFilter(testing::path(3), 1), std::logic_error);
}

TEST(Transforms, SmallestGraphs) {
  const MeyerFilterBank bank(3, 0.0);
  const SparseMatrix none(0, 0);
  EXPECT_EQ(exact_transform(dense_spectrum(none), bank, MatrixXd(0, 2)).cols(), 6);
  EXPECT_EQ(chebyshev_transform(none, bank, MatrixXd(0, 2)).coefficients.cols(), 6);
  const SparseMatrix one = testing::laplacian_of(1, {});
  const MatrixXd expected = (MatrixXd(1, 3) << 5, 0, 0).finished();
  EXPECT_EQ(exact_transform(dense_spectrum(one), bank, MatrixXd::Constant(1, 1, 5.0)), expected);
  EXPECT_EQ(chebyshev_transform(one, bank, MatrixXd::Constant(1, 1, 5.0)).coefficients, expected);
  EXPECT_EQ(chebyshev_transform(one, bank, MatrixXd(1, 0)).coefficients.cols(), 0);
  EXPECT_THROW((void)chebyshev_transform(one, bank, MatrixXd(2, 1)), std::logic_error);
}

}  // namespace wavelet_transform_test
}  // namespace tutti::spectral
