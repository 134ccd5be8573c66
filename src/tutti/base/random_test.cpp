// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/random.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

namespace tutti {
namespace random_test {

std::vector<double> draws(Rng rng, int n) {
  std::vector<double> out;
  for (int i = 0; i < n; ++i) out.push_back(rng.uniform(0.0, 1.0));
  return out;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - 0.5) * (b[i] - 0.5);
  return 12.0 * sum / static_cast<double>(a.size());  // 1/12 = variance of a uniform number
}

TEST(Rng, SameSeedSameNumbers) {
  EXPECT_EQ(draws(Rng(7), 100), draws(Rng(7), 100));
  EXPECT_NE(draws(Rng(7), 100), draws(Rng(8), 100));
}

TEST(Rng, ForksDependOnSeedAndNameAlone) {
  Rng used(7);
  used.uniform(0.0, 1.0);
  EXPECT_EQ(draws(Rng(7).fork("alpha"), 10), draws(used.fork("alpha"), 10));
  EXPECT_NE(draws(Rng(7).fork("alpha"), 10), draws(Rng(8).fork("alpha"), 10));
  EXPECT_NE(draws(Rng(7).fork("a").fork("b"), 10), draws(Rng(7).fork("b").fork("a"), 10));
}

TEST(Rng, ForksAreDistinctAndUncorrelated) {
  std::set<double> first;
  const Rng parent(0);  // the seed most likely to be degenerate
  first.insert(draws(parent, 1)[0]);
  for (const char* name : {"", "0", "1", "alpha", "bravo", "alpha/odometry"})
    first.insert(draws(parent.fork(name), 1)[0]);
  for (std::uint64_t i = 0; i < 1000; ++i) first.insert(draws(parent.fork(i), 1)[0]);
  EXPECT_EQ(first.size(), 1007U);

  const int n = 20'000;
  const double five_sigma = 5.0 / std::sqrt(n);
  EXPECT_LT(std::abs(correlation(draws(parent.fork(0), n), draws(parent.fork(1), n))), five_sigma);
  EXPECT_LT(std::abs(correlation(draws(parent, n), draws(parent.fork("a"), n))), five_sigma);
}

TEST(Rng, DistributionsHaveTheirMoments) {
  Rng rng(3);
  const int n = 100'000;
  double sum = 0.0;
  double squares = 0.0;
  int heads = 0;
  std::vector<int> counts(5);
  for (int i = 0; i < n; ++i) {
    const double x = rng.normal(2.0);
    sum += x;
    squares += x * x;
    heads += rng.bernoulli(0.3) ? 1 : 0;
    ++counts[rng.index(5)];
    const double u = rng.uniform(-1.0, 4.0);
    ASSERT_TRUE(u >= -1.0 && u < 4.0);
  }
  EXPECT_NEAR(sum / n, 0.0, 5.0 * 2.0 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 4.0, 5.0 * 4.0 * std::sqrt(2.0 / n));
  EXPECT_NEAR(heads / static_cast<double>(n), 0.3, 5.0 * std::sqrt(0.21 / n));
  for (const int count : counts) EXPECT_NEAR(count / static_cast<double>(n), 0.2, 5.0 * std::sqrt(0.16 / n));
}

TEST(Rng, CertainAndImpossible) {
  Rng rng(1);
  for (int i = 0; i < 1000; ++i) {
    EXPECT_TRUE(rng.bernoulli(1.0));
    EXPECT_FALSE(rng.bernoulli(0.0));
    EXPECT_EQ(rng.index(1), 0U);
  }
}

}  // namespace random_test
}  // namespace tutti
