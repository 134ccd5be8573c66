// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/chi_square.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tutti {
namespace chi_square_test {

// Abramowitz and Stegun, "Handbook of Mathematical Functions", table 26.8.
TEST(ChiSquare, AgreesWithTables) {
  EXPECT_NEAR(chi_square_quantile(0.5, 6.0), 5.348, 5e-4);
  EXPECT_NEAR(chi_square_quantile(0.99, 6.0), 16.812, 5e-4);
  EXPECT_NEAR(chi_square_quantile(0.999, 6.0), 22.458, 5e-4);
  EXPECT_NEAR(chi_square_quantile(0.95, 3.0), 7.815, 5e-4);
  EXPECT_NEAR(chi_square_exceeded_with(1e-4, 3.0), 21.108, 5e-4);
  EXPECT_NEAR(chi_square_quantile(0.95, 100.0), 124.342, 5e-4);
  EXPECT_NEAR(chi_square_quantile(0.0, 6.0), 0.0, 1e-9);
}

TEST(ChiSquare, QuantilesInvertProbabilities) {
  for (const double degrees : {0.7, 1.0, 3.0, 6.0, 47.3, 800.0})
    for (double p = 0.01; p < 1.0; p += 0.07)
      EXPECT_NEAR(chi_square_probability(chi_square_quantile(p, degrees), degrees), p, 1e-9) << degrees;
}

// With two degrees of freedom the tail is exp(-x / 2).
TEST(ChiSquare, SmallProbabilitiesKeepTheirDigits) {
  for (const double p : {1e-3, 1e-9, 1e-15})
    EXPECT_NEAR(chi_square_exceeded_with(p, 2.0), -2.0 * std::log(p), 1e-6 * -std::log(p));
}

}  // namespace chi_square_test
}  // namespace tutti
