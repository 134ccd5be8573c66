// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/internal/row_blocks.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <numeric>
#include <tuple>
#include <vector>

#include "support/spectral/graphs.hpp"
#include "tutti/spectral/internal/bandwidth.hpp"

namespace tutti::spectral::internal {
namespace row_blocks_test {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd random_vector(Eigen::Index size, Rng& rng) {
  return VectorXd::NullaryExpr(size, [&] { return rng.uniform(-1.0, 1.0); });
}

/// Edges between nodes that are at most `reach` apart, in a random numbering.
SparseMatrix banded(int nodes, int reach, Rng& rng) {
  const auto to = testing::random_permutation(nodes, rng);
  std::vector<WeightedEdge> edges;
  for (int a = 0; a < nodes; ++a)
    for (int b = std::max(0, a - reach); b < a; ++b)
      edges.push_back({to[static_cast<std::size_t>(a)], to[static_cast<std::size_t>(b)], rng.uniform(0.1, 1.0)});
  return testing::laplacian_of(nodes, edges);
}

RC_GTEST_PROP(RowBlocks, ManyStepsAreTheSameToTheBitAsOneAfterAnother, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(1, 2000), count = *rc::gen::inRange(0, 40), scales = *rc::gen::inRange(0, 4);
  const SparseMatrix M = banded(nodes, *rc::gen::inRange(0, 30), rng);
  const RowBlocks blocks(M);
  const MatrixXd weights = MatrixXd::NullaryExpr(scales, count, [&] { return rng.uniform(-1.0, 1.0); });
  std::vector<RowBlocks::Step> steps;
  for (int k = 0; k < count; ++k)
    steps.push_back({rng.uniform(-0.1, 0.1),
                     rng.uniform(-1.0, 1.0),
                     {weights.col(k).data(), rng.index(static_cast<std::size_t>(scales) + 1)}});
  const VectorXd x = blocks.to_blocks(random_vector(nodes, rng)), y = blocks.to_blocks(random_vector(nodes, rng));
  const MatrixXd sums = MatrixXd::Zero(blocks.size(), scales);

  auto [x_each, y_each, sums_each] = std::tuple(x, y, sums);
  for (const RowBlocks::Step& step : steps) {
    blocks.run({&step, 1}, x_each, y_each, sums_each);
  }
  auto [x_all, y_all, sums_all] = std::tuple(x, y, sums);
  blocks.run(steps, x_all, y_all, sums_all, *rc::gen::element(0UL, 5'000UL, 50'000UL, 1'000'000'000UL));
  RC_ASSERT(x_all == x_each);
  RC_ASSERT(y_all == y_each);
  RC_ASSERT(sums_all == sums_each);
}

RC_GTEST_PROP(RowBlocks, AStepIsAProductWithTheMatrix, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(1, 200);
  const SparseMatrix M = banded(nodes, *rc::gen::inRange(0, 30), rng);
  const RowBlocks blocks(M);
  const VectorXd x = random_vector(nodes, rng), y = random_vector(nodes, rng);
  VectorXd out = blocks.to_blocks(y), back(nodes);
  blocks.step(0.5, -2.0, blocks.to_blocks(x), out);
  blocks.from_blocks(out, back);
  RC_ASSERT((back - (0.5 * (M * x) - 2.0 * x - y)).cwiseAbs().maxCoeff() <= 1e-12);
}

RC_GTEST_PROP(GatherNeighbours, TakesEachNodeOnce, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(0, 80), count = *rc::gen::inRange(1, 10);
  const SparseMatrix L = testing::laplacian_of(nodes, testing::random_edges(nodes, *rc::gen::inRange(1, 4), rng));
  auto taken = gather_neighbours(L, bandwidth_reducing_order(L), count);
  std::ranges::sort(taken);
  std::vector<int> all(static_cast<std::size_t>(nodes));
  std::iota(all.begin(), all.end(), 0);
  RC_ASSERT(taken == all);
}

TEST(GatherNeighbours, RowsOfAnAreaShareTheirColumns) {
  constexpr int kSide = 60;
  std::vector<Eigen::Vector3d> positions;
  for (int n = 0; n < kSide * kSide; ++n) positions.emplace_back(n % kSide, n / kSide, 0.0);
  const SparseMatrix L = laplacian(proximity_adjacency(positions, 4.5, 1.0));
  const double entries = static_cast<double>(RowBlocks(L).entries());
  EXPECT_LT(entries, 1.7 * static_cast<double>(L.nonZeros()));  // 2.6 times without
}

TEST(RowBlocks, ALongMatrixIsReadOnceForManyStepsAndAShortOneIsNotCut) {
  Rng rng(1);
  const RowBlocks small(banded(2000, 20, rng)), large(banded(100'000, 20, rng));
  EXPECT_EQ(small.wave(std::size_t{1} << 22U).steps, 1U);
  const RowBlocks::Wave wave = large.wave();
  EXPECT_GE(wave.steps, 8U);
  EXPECT_GT(wave.rows, static_cast<std::ptrdiff_t>(wave.steps));
}

}  // namespace row_blocks_test
}  // namespace tutti::spectral::internal
