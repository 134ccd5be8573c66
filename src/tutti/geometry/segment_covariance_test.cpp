// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/segment_covariance.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti {
namespace segment_covariance_test {

struct Chain {
  std::vector<Pose3> poses;
  std::vector<Matrix6d> steps;
};

Matrix6d any_covariance(Rng& rng, double sigma) {
  Matrix6d A;
  for (double& value : A.reshaped()) value = sigma * rng.normal();
  return A * A.transpose() + 1e-3 * sigma * sigma * Matrix6d::Identity();
}

Chain any_chain(Rng& rng, std::size_t n) {
  Chain out;
  for (std::size_t k = 0; k < n; ++k) {
    Vector6d step;
    for (double& value : step) value = rng.normal();
    out.poses.push_back(k == 0 ? Pose3{} : retract(out.poses.back(), step));
    out.steps.push_back(any_covariance(rng, 0.01));
  }
  return out;
}

TEST(SegmentCovariance, CompoundsStepByStep) {
  Rng rng(3);
  for (const std::size_t n : {1UL, 2UL, 5UL, 16UL, 17UL, 37UL, 290UL}) {
    const Chain chain = any_chain(rng, n);
    const SegmentCovariance segment(chain.poses, chain.steps);
    for (std::size_t a = 0; a < n; ++a) {
      Matrix6d expected = Matrix6d::Zero();
      for (std::size_t b = a; b < n; ++b) {
        if (b > a)
          expected = compound_covariance(chain.poses[b - 1].inverse() * chain.poses[b], expected, chain.steps[b]);
        EXPECT_LT((segment(a, b) - expected).norm(), 1e-9 * (1.0 + expected.norm())) << a << " " << b << " of " << n;
      }
    }
  }
}

// Differences of prefix sums are not: a step of 10 m and 0.3 rad kilometres away drowns the millimetres of this one.
TEST(SegmentCovariance, IsPositiveDefiniteBesideStepsThatAreUnknown) {
  Rng rng(4);
  Chain chain = any_chain(rng, 300);
  for (std::size_t k = 0; k < chain.poses.size(); ++k) {
    chain.poses[k].translation.x() += 1000.0 * static_cast<double>(k % 7);
    chain.steps[k] = k % 50 == 0 ? Matrix6d(any_covariance(rng, 10.0)) : Matrix6d(any_covariance(rng, 1e-5));
  }
  const SegmentCovariance segment(chain.poses, chain.steps);
  for (std::size_t a = 0; a + 1 < chain.poses.size(); ++a) {
    const Matrix6d C = segment(a, a + 1);
    EXPECT_GT(eigen_of(C).values(0), 0.0) << a;
    if ((a + 1) % 50 != 0) {
      EXPECT_LT(C.norm(), 1e-7) << a;
    }
  }
}

}  // namespace segment_covariance_test
}  // namespace tutti
