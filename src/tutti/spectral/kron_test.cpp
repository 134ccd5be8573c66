// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/kron.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <set>

#include "support/spectral/graphs.hpp"
#include "tutti/spectral/spectrum.hpp"

namespace tutti::spectral {
namespace kron_test {

using Eigen::MatrixXd;
using Eigen::Vector3d;

std::vector<int> random_subset(int nodes, double share, Rng& rng) {
  std::vector<int> out;
  for (int n = 0; n < nodes; ++n)
    if (rng.bernoulli(share)) out.push_back(n);
  return out;
}

/// Effective resistances between all nodes of a connected graph, through the pseudo-inverse.
MatrixXd resistances(const SparseMatrix& L) {
  const Eigen::Index n = L.rows();
  const MatrixXd mean = MatrixXd::Constant(n, n, 1.0 / static_cast<double>(n));
  const MatrixXd inverse = (MatrixXd(L) + mean).inverse() - mean;
  MatrixXd out(n, n);
  for (Eigen::Index a = 0; a < n; ++a)
    for (Eigen::Index b = 0; b < n; ++b) out(a, b) = inverse(a, a) + inverse(b, b) - 2.0 * inverse(a, b);
  return out;
}

void check_is_laplacian(const MatrixXd& L) {
  RC_ASSERT(L == L.transpose());
  for (Eigen::Index a = 0; a < L.rows(); ++a) {
    RC_ASSERT(std::abs(L.row(a).sum()) <= 1e-14 * (1.0 + L(a, a)));
    for (Eigen::Index b = 0; b < a; ++b) RC_ASSERT(L(a, b) <= 0.0);
  }
}

/// A path through all nodes makes it connected.
SparseMatrix connected_graph(int nodes, Rng& rng) {
  auto edges = testing::random_edges(nodes, 1, rng);
  for (int n = 0; n + 1 < nodes; ++n) edges.push_back({n, n + 1, 0.1});
  return testing::laplacian_of(nodes, edges);
}

RC_GTEST_PROP(KronReduce, IsTheDenseSchurComplement, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(2, 50);
  const SparseMatrix L = connected_graph(nodes, rng);
  auto keep = random_subset(nodes, 0.5, rng);
  if (keep.empty()) keep.push_back(0);
  std::vector<int> drop;
  for (int n = 0; n < nodes; ++n)
    if (!std::binary_search(keep.begin(), keep.end(), n)) drop.push_back(n);
  const MatrixXd dense = L;
  MatrixXd expected = dense(keep, keep);
  if (!drop.empty()) expected -= dense(keep, drop) * dense(drop, drop).ldlt().solve(dense(drop, keep));
  const auto reduction = kron_reduce(L, keep);
  RC_ASSERT(reduction.kept == keep);
  check_is_laplacian(reduction.laplacian);
  RC_ASSERT((MatrixXd(reduction.laplacian) - expected).cwiseAbs().maxCoeff() <= 1e-11);
}

RC_GTEST_PROP(KronReduce, KeepsEffectiveResistances, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(2, 40);
  const SparseMatrix L = connected_graph(nodes, rng);
  auto keep = random_subset(nodes, 0.4, rng);
  if (keep.empty()) keep.push_back(nodes - 1);
  const MatrixXd before = resistances(L)(keep, keep);
  const MatrixXd after = resistances(kron_reduce(L, keep).laplacian);
  RC_ASSERT((before - after).cwiseAbs().maxCoeff() <= 1e-9 * (1.0 + before.maxCoeff()));
}

RC_GTEST_PROP(KronReduce, InTwoStepsIsTheSameAsInOne, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(1, 50);
  const SparseMatrix L = testing::laplacian_of(nodes, testing::random_edges(nodes, 3, rng));
  const auto keep_first = random_subset(nodes, 0.7, rng);
  std::vector<int> keep_second, of_first;  // the same nodes, numbered in the original and in the first reduction
  for (std::size_t k = 0; k < keep_first.size(); ++k) {
    if (!rng.bernoulli(0.5)) continue;
    keep_second.push_back(keep_first[k]);
    of_first.push_back(static_cast<int>(k));
  }
  const MatrixXd direct = kron_reduce(L, keep_second).laplacian;
  const MatrixXd stepwise = kron_reduce(kron_reduce(L, keep_first).laplacian, of_first).laplacian;
  RC_ASSERT((direct.size() == 0 || (direct - stepwise).cwiseAbs().maxCoeff() <= 1e-12));
}

TEST(KronReduce, ResistorsInSeriesAndStarToMesh) {
  const MatrixXd series = kron_reduce(testing::path(3), std::vector<int>{2, 0, 0}).laplacian;
  EXPECT_DOUBLE_EQ(series(0, 1), -0.5);
  const MatrixXd mesh = kron_reduce(testing::star(5), std::vector<int>{1, 2, 3, 4}).laplacian;
  EXPECT_TRUE(mesh.isApprox(MatrixXd(testing::complete(4)) / 4.0, 1e-15));
}

TEST(KronReduce, ComponentsWithoutKeptNodesVanish) {
  const SparseMatrix L = testing::laplacian_of(6, {{0, 1, 1.0}, {1, 2, 1.0}, {3, 4, 1.0}});  // 5 is isolated
  const auto reduction = kron_reduce(L, std::vector<int>{0, 2});
  EXPECT_DOUBLE_EQ(reduction.laplacian.coeff(0, 1), -0.5);
  EXPECT_EQ(kron_reduce(L, std::vector<int>{5}).laplacian.coeff(0, 0), 0.0);
  EXPECT_EQ(kron_reduce(L, {}).laplacian.rows(), 0);
  EXPECT_EQ(kron_reduce(SparseMatrix(0, 0), {}).kept.size(), 0U);
  EXPECT_THROW((void)kron_reduce(L, std::vector<int>{6}), std::logic_error);
}

TEST(KronReduce, WeakBridgesSurviveManyOrdersOfMagnitude) {
  // Two triangles joined by a bridge of 1e-30: a subtraction would lose it.
  const SparseMatrix L = testing::laplacian_of(
      6, {{0, 1, 1.0}, {1, 2, 1.0}, {0, 2, 1.0}, {2, 3, 1e-30}, {3, 4, 1.0}, {4, 5, 1.0}, {3, 5, 1.0}});
  const auto reduction = kron_reduce(L, std::vector<int>{0, 5});
  EXPECT_NEAR(reduction.laplacian.coeff(0, 1), -1e-30, 1e-42);
  EXPECT_EQ(connected_components(kron_reduce(L, std::vector<int>{0, 1, 4, 5}).laplacian).count, 1);
}

RC_GTEST_PROP(Sparsify, StaysAConnectedLaplacian, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(0, 50);
  const SparseMatrix L = testing::laplacian_of(nodes, testing::random_edges(nodes, 2, rng));
  const double threshold = rng.uniform(0.0, 1.2);
  const SparseMatrix sparse = sparsify(L, threshold);
  check_is_laplacian(sparse);
  RC_ASSERT(connected_components(sparse).label == connected_components(L).label);
  RC_ASSERT(sparse.nonZeros() <= L.nonZeros());
  RC_ASSERT((nodes == 0 || MatrixXd(sparsify(L, 0.0)).isApprox(MatrixXd(L), 1e-14)));
}

TEST(Sparsify, DropsWeakEdgesOnly) {
  const SparseMatrix L = testing::laplacian_of(3, {{0, 1, 1.0}, {1, 2, 1.0}, {0, 2, 0.01}});
  EXPECT_EQ(sparsify(L, 0.02).coeff(0, 2), 0.0);
  EXPECT_EQ(sparsify(L, 0.02).coeff(0, 1), -1.0);
  EXPECT_EQ(sparsify(L, 0.009).coeff(0, 2), -0.01);
}

TEST(SelectLargestEigenvector, FollowsTheSignAndKeepsNoise) {
  // u_max of a star is large at the centre and negative at the leaves; the separate pair of nodes is exactly noise.
  const SparseMatrix L = testing::laplacian_of(6, {{0, 1, 1.0}, {0, 2, 1.0}, {0, 3, 1.0}, {4, 5, 1e-3}});
  EXPECT_EQ(select_largest_eigenvector(L), (std::vector<int>{0, 4, 5}));
  EXPECT_EQ(select_largest_eigenvector(L, std::vector<int>{2}), (std::vector<int>{0, 2, 4, 5}));
  EXPECT_EQ(select_largest_eigenvector(L, {}, 2.0).size(), 6U);
  EXPECT_TRUE(select_largest_eigenvector(SparseMatrix(0, 0)).empty());
}

RC_GTEST_PROP(SelectBudget, MeetsTheBudgetAndKeepsWhatItMust, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(0, 80);
  std::vector<Vector3d> positions;
  for (int n = 0; n < nodes; ++n) positions.emplace_back(rng.uniform(0, 30), rng.uniform(0, 30), 0.0);
  const SparseMatrix L = laplacian(proximity_adjacency(positions, 7.0, 1.0));
  const auto must_keep = random_subset(nodes, 0.2, rng);
  const int budget = *rc::gen::inRange(-1, 100);
  const auto kept = select_budget(L, positions, budget, must_keep);
  RC_ASSERT(static_cast<int>(kept.size()) == std::min(nodes, std::max(budget, static_cast<int>(must_keep.size()))));
  RC_ASSERT(std::set<int>(kept.begin(), kept.end()).size() == kept.size());
  RC_ASSERT(std::includes(kept.begin(), kept.end(), must_keep.begin(), must_keep.end()));
}

RC_GTEST_PROP(SelectBudget, DoesNotDependOnTheNumbering, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(1, 80);
  std::vector<Vector3d> positions, moved(static_cast<std::size_t>(nodes));
  for (int n = 0; n < nodes; ++n) positions.emplace_back(rng.uniform(0, 30), rng.uniform(0, 30), 0.0);
  const auto to = testing::random_permutation(nodes, rng);
  for (std::size_t n = 0; n < to.size(); ++n) moved[static_cast<std::size_t>(to[n])] = positions[n];
  const int budget = *rc::gen::inRange(0, 60);
  auto kept = select_budget(laplacian(proximity_adjacency(positions, 7.0, 1.0)), positions, budget);
  const auto kept_moved = select_budget(laplacian(proximity_adjacency(moved, 7.0, 1.0)), moved, budget);
  for (int& n : kept) n = to[static_cast<std::size_t>(n)];
  std::sort(kept.begin(), kept.end());
  RC_ASSERT(kept == kept_moved);
}

TEST(SelectBudget, EveryComponentIsRepresentedFirst) {
  std::vector<Vector3d> positions;
  for (const double x : {0.0, 100.0, 200.0})
    for (int n = 0; n < 10; ++n) positions.emplace_back(x + n, 0.0, 0.0);
  const SparseMatrix L = laplacian(proximity_adjacency(positions, 7.0, 1.0));
  const auto kept = select_budget(L, positions, 3);
  ASSERT_EQ(kept.size(), 3U);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(kept[static_cast<std::size_t>(c)] / 10, c);
}

TEST(SelectBudget, LowSpectrumOfATunnelSurvives) {
  const auto positions = testing::tunnel(400, 1.0, Rng(4));
  const SparseMatrix L = laplacian(proximity_adjacency(positions, 7.0, 1.0));
  const auto reduced = kron_reduce(L, select_budget(L, positions, 200)).laplacian;
  const auto before = dense_spectrum(L).eigenvalues;
  const auto after = dense_spectrum(reduced).eigenvalues;
  // Half of the nodes, half of the mass: every low eigenvalue doubles.
  for (int k = 1; k <= 8; ++k) EXPECT_NEAR(after[k] / before[k] / 2.0, 1.0, 0.05) << "k = " << k;
}

}  // namespace kron_test
}  // namespace tutti::spectral
