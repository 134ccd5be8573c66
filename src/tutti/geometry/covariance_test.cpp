// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/covariance.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tutti/geometry/symmetric.hpp"

namespace tutti {
namespace covariance_test {

/// Standard deviations of 1 cm and 1 mrad; the first two coordinates correlated.
Matrix6d example(double correlation = 0.5) {
  Vector6d sigma;
  sigma << 0.01, 0.02, 0.01, 1e-3, 1e-3, 2e-3;
  Matrix6d out = sigma.cwiseAbs2().asDiagonal();
  out(0, 1) = out(1, 0) = correlation * sigma(0) * sigma(1);
  return out;
}

Matrix6d in_the_plane() {
  Matrix6d out = example();
  for (const int flat : {2, 3, 4}) out(flat, flat) = 0.0;
  return out;
}

TEST(Covariance, OdometryInThePlaneIsOne) {
  EXPECT_TRUE(check_covariance(example()));
  EXPECT_TRUE(check_covariance(in_the_plane()));
  EXPECT_TRUE(check_covariance(Matrix6d::Zero()));
  EXPECT_TRUE(check_covariance(example(1.0)));
}

TEST(Covariance, WhatIsNoneIsNamed) {
  const auto message = [](const Matrix6d& m) {
    const Status ok = check_covariance(m);
    return ok ? std::string() : ok.error().message;
  };
  Matrix6d wrong = example();
  wrong(3, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(message(wrong).find("not finite"), std::string::npos);
  wrong = example();
  wrong(0, 1) = 0.0;
  EXPECT_NE(message(wrong).find("not symmetric"), std::string::npos);
  wrong = example();
  wrong(5, 5) = -1e-6;
  EXPECT_NE(message(wrong).find("negative variance (-1e-06)"), std::string::npos);
  wrong = in_the_plane();
  wrong(0, 2) = wrong(2, 0) = 1e-5;
  EXPECT_NE(message(wrong).find("row 2"), std::string::npos);
  EXPECT_NE(message(example(1.01)).find("semidefinite"), std::string::npos);
}

TEST(Covariance, BoundsLeaveWhatIsKnownAndItsCorrelations) {
  EXPECT_EQ(bounded_covariance(example()), example());
  Matrix6d unknown = 1e12 * example();  // 10 km and 1000 rad
  const Matrix6d bounded = bounded_covariance(unknown);
  EXPECT_NEAR(bounded(0, 0), 1e4, 1e-6);
  EXPECT_NEAR(bounded(5, 5), 9.0, 1e-9);
  EXPECT_NEAR(bounded(0, 1) / std::sqrt(bounded(0, 0) * bounded(1, 1)), 0.5, 1e-12);
  unknown = example();
  unknown(2, 2) = 1e20;  // "the height is unknown"
  Matrix6d expected = example();
  expected(2, 2) = 1e4;
  EXPECT_LT((bounded_covariance(unknown) - expected).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Covariance, InvertibleAddsOnlyWhereNeeded) {
  EXPECT_EQ(invertible_covariance(example()), example());
  for (const Matrix6d& singular : {in_the_plane(), Matrix6d(Matrix6d::Zero()), example(1.0)}) {
    const Matrix6d made = invertible_covariance(singular);
    EXPECT_LE((made - singular).cwiseAbs().maxCoeff(), 1.0001e-8);
    const Matrix6d inverse = inverse_of(made);
    EXPECT_TRUE(inverse.allFinite());
    EXPECT_LT((made * inverse - Matrix6d::Identity()).cwiseAbs().maxCoeff(), 1e-3);
  }
}

}  // namespace covariance_test
}  // namespace tutti
