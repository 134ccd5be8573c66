// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/chain_transform.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/spectral/graph.hpp"
#include "tutti/spectral/wavelet_transform.hpp"

namespace tutti::spectral {
namespace {

Eigen::MatrixXd noise(Eigen::Index n, Eigen::Index d, std::uint64_t seed) {
  Rng rng(seed);
  return Eigen::MatrixXd::NullaryExpr(n, d, [&] { return rng.normal(); });
}

TEST(ChainTransform, IsTheExactTransformOfThePathGraph) {
  for (const int n : {1, 2, 3, 12, 61, 128}) {
    std::vector<WeightedEdge> edges;
    for (int i = 0; i + 1 < n; ++i) edges.push_back({i, i + 1, 1.0});
    const SparseMatrix L = laplacian(adjacency_from_edges(n, edges));
    for (const int scales : {2, 7, 11}) {
      const MeyerFilterBank bank(scales, kChainLambdaMax);
      const Eigen::MatrixXd f = noise(n, 3, static_cast<std::uint64_t>(n));
      const Eigen::MatrixXd exact = exact_transform(dense_spectrum(L), bank, f);
      EXPECT_LT((chain_transform(bank, f) - exact).cwiseAbs().maxCoeff(), 1e-12) << n << " nodes, " << scales;
    }
  }
}

TEST(ChainTransform, KeepsTheEnergy) {  // Meyer's bank is a tight frame
  const Eigen::MatrixXd f = noise(200, 2, 5);
  const Eigen::MatrixXd W = chain_transform(MeyerFilterBank(12, kChainLambdaMax), f);
  EXPECT_NEAR(W.squaredNorm(), f.squaredNorm(), 1e-9 * f.squaredNorm());
}

TEST(ChainTransform, FastLengthsHaveSmallFactorsOnly) {
  for (Eigen::Index n = 1; n < 3000; ++n) {
    const Eigen::Index length = fast_chain_length(n);
    EXPECT_GE(length, n);
    EXPECT_LE(length, n + n / 8 + 1);
    Eigen::Index rest = length;
    for (const Eigen::Index factor : {2, 3, 5})
      while (rest % factor == 0) rest /= factor;
    EXPECT_EQ(rest, 1);
  }
}

TEST(ChainTransform, AConstantStaysInTheLargestScale) {
  const Eigen::MatrixXd W = chain_transform(MeyerFilterBank(5, kChainLambdaMax), Eigen::MatrixXd::Constant(30, 1, 7.0));
  EXPECT_LT((W.col(0).array() - 7.0).abs().maxCoeff(), 1e-12);
  EXPECT_LT(W.rightCols(4).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace tutti::spectral
