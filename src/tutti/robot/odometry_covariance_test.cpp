// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/odometry_covariance.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::robot {
namespace odometry_covariance_test {

RC_GTEST_PROP(IncrementCovariances, CuttingAStraightStepChangesNothing, ()) {
  const double alpha = 0.01 * *rc::gen::inRange(1, 100);
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  Vector6d any;
  for (double& a : any) a = rng.normal();
  const Pose3 a = retract({}, any);
  const Pose3 b = retract(a, (Vector6d() << rng.normal(), rng.normal(), 0, 0, 0, rng.normal(0.5)).finished());
  const Timestamp begin{0};
  const Timestamp middle = begin + alpha;
  const Timestamp end = begin + 1.0;
  const auto whole = increment_covariances({{begin, a}, {end, b}}, {});
  const auto parts = increment_covariances({{begin, a}, {middle, interpolate(a, b, alpha)}, {end, b}}, {});
  RC_ASSERT(whole.size() == 1U);
  RC_ASSERT(parts.size() == 2U);
  RC_ASSERT((parts[0] + parts[1] - whole[0]).norm() < 1e-9 * whole[0].norm());
}

TEST(IncrementCovariances, GrowWithEachCause) {
  const Pose3 forward{Eigen::Quaterniond::Identity(), {4.0, 0.0, 0.0}};
  OdometryCovarianceConfig config;
  const auto covariance = increment_covariances({{{0}, {}}, {{1'000'000'000}, forward}}, config);
  EXPECT_NEAR(std::sqrt(covariance[0](0, 0)), std::hypot(0.04, 0.003), 1e-12);
  EXPECT_NEAR(std::sqrt(covariance[0](5, 5)) / kRadPerDeg, std::hypot(0.2, 0.02), 1e-12);
  const auto standing = increment_covariances({{{0}, {}}, {{1'000'000'000}, {}}}, config);
  EXPECT_NEAR(std::sqrt(standing[0](0, 0)), 0.003, 1e-12);
}

}  // namespace odometry_covariance_test
}  // namespace tutti::robot
