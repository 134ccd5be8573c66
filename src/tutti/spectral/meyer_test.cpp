// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/meyer.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <stdexcept>

namespace tutti::spectral {
namespace meyer_test {

RC_GTEST_PROP(MeyerFilterBank, TightFrameOnTheSpectrum, ()) {
  const int scales = *rc::gen::inRange(1, 15);
  const double lambda_max = *rc::gen::inRange(1, 100000) * 1e-3;
  const double lambda = lambda_max * *rc::gen::inRange(0, 100001) * 1e-5;
  const MeyerFilterBank bank(scales, lambda_max);
  double energy = 0.0;
  for (int s = 0; s < scales; ++s) energy += std::pow(bank.kernel(s, lambda), 2);
  RC_ASSERT(std::abs(energy - 1.0) <= 4e-15);
}

RC_GTEST_PROP(MeyerFilterBank, OnlyNeighbouringScalesOverlap, ()) {
  const int scales = *rc::gen::inRange(3, 10);
  const double lambda = *rc::gen::inRange(0, 20001) * 1e-4;
  const MeyerFilterBank bank(scales, 1.0);
  for (int a = 0; a < scales; ++a)
    for (int b = a + 2; b < scales; ++b) RC_ASSERT(bank.kernel(a, lambda) * bank.kernel(b, lambda) == 0.0);
}

TEST(MeyerFilterBank, BandsAreWhereTheyShouldBe) {
  const MeyerFilterBank bank(7, 64.0);
  EXPECT_EQ(bank.kernel(0, 0.99), 1.0);
  EXPECT_GT(bank.kernel(0, 1.99), 0.0);
  EXPECT_EQ(bank.kernel(0, 2.0), 0.0);
  for (int s = 1; s < 7; ++s) {
    EXPECT_EQ(bank.kernel(s, std::ldexp(0.999, s - 1)), 0.0);
    EXPECT_NEAR(bank.kernel(s, std::ldexp(1.0, s)), 1.0, 1e-15);
    EXPECT_EQ(bank.kernel(s, std::ldexp(1.001, s + 1)), 0.0);
  }
}

TEST(MeyerFilterBank, BeyondTheSpectrum) {
  const MeyerFilterBank bank(3, 2.0);
  EXPECT_NEAR(bank.kernel(2, 3.0), std::sqrt(0.5), 1e-15);  // rolls off: v(1/2) = 1/2
  EXPECT_EQ(bank.kernel(2, 4.0), 0.0);
  EXPECT_EQ(bank.kernel(0, -1e-15), 1.0);
  EXPECT_EQ(bank.kernel(1, -1e-15), 0.0);
}

TEST(MeyerFilterBank, DegenerateBanks) {
  const MeyerFilterBank pass(1, 5.0);
  EXPECT_EQ(pass.kernel(0, 4.9), 1.0);
  const MeyerFilterBank no_edges(4, 0.0);
  EXPECT_EQ(no_edges.kernel(0, 0.0), 1.0);
  EXPECT_EQ(no_edges.kernel(3, 0.0), 0.0);
  EXPECT_EQ(no_edges.kernel(0, 1.0), 0.0);
  EXPECT_THROW(MeyerFilterBank(0, 1.0), std::logic_error);
  EXPECT_THROW(MeyerFilterBank(3, std::nan("")), std::logic_error);
  EXPECT_THROW((void)no_edges.kernel(4, 0.0), std::logic_error);
}

}  // namespace meyer_test
}  // namespace tutti::spectral
