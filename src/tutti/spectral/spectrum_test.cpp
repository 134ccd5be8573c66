// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/spectrum.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "support/spectral/graphs.hpp"

extern "C" void openblas_set_num_threads(int threads);

namespace tutti::spectral {
namespace spectrum_test {

using Eigen::MatrixXd;
using Eigen::VectorXd;

void expect_eigenvalues(const SparseMatrix& L, std::vector<double> expected) {
  std::sort(expected.begin(), expected.end());
  const VectorXd eigenvalues = dense_spectrum(L).eigenvalues;
  ASSERT_EQ(eigenvalues.size(), static_cast<Eigen::Index>(expected.size()));
  for (std::size_t k = 0; k < expected.size(); ++k)
    EXPECT_NEAR(eigenvalues[static_cast<Eigen::Index>(k)], expected[k], 1e-12) << "k = " << k;
  EXPECT_NEAR(largest_eigenvalue(L), expected.back(), 1e-9 * expected.back());
  EXPECT_NEAR(largest_eigenpair(L).value, expected.back(), 1e-12 * expected.back());
  EXPECT_GE(largest_eigenvalue_bound(L), expected.back() * (1.0 - 1e-14));
}

TEST(Spectrum, OfPathCycleCompleteAndStar) {
  for (const int n : {2, 3, 7, 30, 100}) {
    SCOPED_TRACE(n);
    std::vector<double> path, cycle;
    for (int k = 0; k < n; ++k) {
      path.push_back(2.0 - 2.0 * std::cos(std::numbers::pi * k / n));
      cycle.push_back(2.0 - 2.0 * std::cos(2.0 * std::numbers::pi * k / n));
    }
    expect_eigenvalues(testing::path(n), path);
    if (n > 2) expect_eigenvalues(testing::cycle(n), cycle);
    std::vector<double> complete(static_cast<std::size_t>(n), n);
    complete[0] = 0.0;
    expect_eigenvalues(testing::complete(n), complete);
    std::vector<double> star(static_cast<std::size_t>(n), 1.0);
    star[0] = 0.0;
    star[1] = n;
    expect_eigenvalues(testing::star(n), star);
  }
}

TEST(Spectrum, HasTheSameBitsWhateverBlasIsSetTo) {
  const SparseMatrix L = testing::cycle(300);
  openblas_set_num_threads(1);
  const Spectrum one = dense_spectrum(L);
  openblas_set_num_threads(3);
  const Spectrum three = dense_spectrum(L);
  openblas_set_num_threads(1);
  EXPECT_EQ(three.eigenvalues, one.eigenvalues);
  EXPECT_EQ(three.eigenvectors, one.eigenvectors);
}

RC_GTEST_PROP(Spectrum, DiagonalisesTheLaplacian, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(1, 60);
  const SparseMatrix L = testing::laplacian_of(nodes, testing::random_edges(nodes, *rc::gen::inRange(1, 4), rng));
  const Spectrum spectrum = dense_spectrum(L);
  const MatrixXd& U = spectrum.eigenvectors;
  const double size = 1.0 + spectrum.eigenvalues.maxCoeff();
  RC_ASSERT((L * U - U * spectrum.eigenvalues.asDiagonal()).norm() <= 1e-13 * size * nodes);
  RC_ASSERT((U.transpose() * U - MatrixXd::Identity(nodes, nodes)).norm() <= 1e-13 * nodes);
  RC_ASSERT(std::is_sorted(spectrum.eigenvalues.begin(), spectrum.eigenvalues.end()));
  RC_ASSERT(spectrum.eigenvalues[0] >= 0.0);
  // One zero eigenvalue per component. Weights span four decades, so the gap is far from rounding.
  const auto zeros = (spectrum.eigenvalues.array() < 1e-12 * size).count();
  RC_ASSERT(zeros == connected_components(L).count);
  for (int k = 0; k < nodes; ++k) RC_ASSERT(U.col(k).maxCoeff() == U.col(k).cwiseAbs().maxCoeff());
}

RC_GTEST_PROP(Spectrum, ExtremalPairIsTheLastOfTheWhole, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(1, 150);
  const SparseMatrix L = testing::laplacian_of(nodes, testing::random_edges(nodes, *rc::gen::inRange(1, 4), rng));
  const VectorXd eigenvalues = dense_spectrum(L).eigenvalues;
  const double top = eigenvalues[nodes - 1];
  const ExtremalPair pair = largest_eigenpair(L);
  RC_ASSERT(pair.converged);
  RC_ASSERT(std::abs(pair.value - top) <= 1e-12 * top);
  RC_ASSERT((L * pair.vector - pair.value * pair.vector).norm() <= 1e-10 * top);
  RC_ASSERT(std::abs(pair.vector.norm() - 1.0) <= 1e-14);
  RC_ASSERT(pair.vector.maxCoeff() == pair.vector.cwiseAbs().maxCoeff());
  RC_ASSERT(std::abs(largest_eigenvalue(L) - top) <= 1e-9 * top);
  RC_ASSERT(largest_eigenvalue(L) <= top * (1.0 + 1e-13));
  RC_ASSERT(largest_eigenvalue_bound(L) >= top * (1.0 - 1e-13));
  RC_ASSERT(largest_eigenvalue_bound(L) <= 2.0 * top * (1.0 + 1e-13));
}

TEST(Spectrum, TunnelByLanczosAndByLapack) {
  const auto positions = testing::tunnel(400, 1.0, Rng(5));
  const SparseMatrix L = laplacian(proximity_adjacency(positions, 7.0, 1.0));
  const double top = dense_spectrum(L).eigenvalues[399];
  EXPECT_NEAR(largest_eigenvalue(L), top, 1e-9 * top);
  EXPECT_NEAR(largest_eigenpair(L).value, top, 1e-12 * top);
}

TEST(Spectrum, SmallestGraphs) {
  const SparseMatrix none(0, 0);
  EXPECT_EQ(dense_spectrum(none).eigenvalues.size(), 0);
  EXPECT_EQ(largest_eigenvalue(none), 0.0);
  EXPECT_TRUE(largest_eigenpair(none).converged);
  for (const int nodes : {1, 2, 100}) {
    const SparseMatrix isolated = testing::laplacian_of(nodes, {});
    EXPECT_EQ(dense_spectrum(isolated).eigenvalues, VectorXd::Zero(nodes));
    EXPECT_EQ(largest_eigenvalue(isolated), 0.0);
    EXPECT_EQ(largest_eigenvalue_bound(isolated), 0.0);
    const ExtremalPair pair = largest_eigenpair(isolated);
    EXPECT_EQ(pair.value, 0.0);
    EXPECT_EQ(pair.vector, VectorXd::Unit(nodes, 0));
    EXPECT_TRUE(pair.converged);
  }
  EXPECT_NEAR(largest_eigenvalue(testing::laplacian_of(100, {{98, 99, 0.5}})), 1.0, 1e-12);
  EXPECT_NEAR(largest_eigenpair(testing::laplacian_of(100, {{98, 99, 0.5}})).value, 1.0, 1e-12);
}

}  // namespace spectrum_test
}  // namespace tutti::spectral
