// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/so3.hpp"

#include <gtest/gtest.h>
// gtest first
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "support/random_pose.hpp"

namespace tutti {
namespace so3_test {

using test::matrix_near;
using test::random_direction;
constexpr double kPi = std::numbers::pi;

/// Identity, tiny, both sides of each series threshold, ordinary, near pi.
const std::vector<double> kAngles{0.0,        1e-200, 1e-12, 1e-8,       9.9999e-5,  1.00001e-4, 9.9999e-4,
                                  1.00001e-3, 0.1,    1.0,   kPi - 1e-3, kPi - 1e-6, kPi - 1e-9, kPi - 1e-14};

std::vector<double> beyond_pi() {
  auto angles = kAngles;
  angles.insert(angles.end(), {kPi, kPi + 0.1, 2.0 * kPi - 0.1, 7.0, 100.0});
  return angles;
}

Eigen::Vector4d reference_exp(const Eigen::Vector3d& theta) {
  const auto t = theta.cast<long double>();
  const long double angle = std::sqrt(t.squaredNorm());
  const long double k = angle == 0.0L ? 0.5L : std::sin(angle / 2) / angle;
  Eigen::Matrix<long double, 4, 1> xyzw;
  xyzw << k * t, std::cos(angle / 2);
  return xyzw.cast<double>();
}

/// Jr = sum_k (-[theta]x)^k / (k + 1)!, the defining series of eq. (143), in long double.
Eigen::Matrix3d reference_right_jacobian(const Eigen::Vector3d& theta) {
  const Eigen::Matrix<long double, 3, 3> minus_w = -skew(theta).cast<long double>();
  Eigen::Matrix<long double, 3, 3> term = Eigen::Matrix<long double, 3, 3>::Identity();
  Eigen::Matrix<long double, 3, 3> sum = term;
  for (int k = 1; k < 60; ++k) {
    term = term * minus_w / static_cast<long double>(k + 1);
    sum += term;
  }
  return sum.cast<double>();
}

TEST(So3, SkewIsTheCrossProduct) {
  Rng rng(1);
  const Eigen::Vector3d a = test::random_vector(rng);
  const Eigen::Vector3d b = test::random_vector(rng);
  EXPECT_TRUE(matrix_near(skew(a) * b, a.cross(b), 1e-15));
}

TEST(So3, ExpIsAccurateAtEveryAngle) {
  Rng rng(2);
  for (const double angle : beyond_pi())
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d theta = angle * random_direction(rng);
      const double scale = std::max(1.0, angle);  // a rounded argument of sine
      EXPECT_TRUE(matrix_near(so3_exp(theta).coeffs(), reference_exp(theta), 1e-15 * scale)) << angle;
      // The vector part also relative to its own size: small rotations keep their digits.
      EXPECT_LE((so3_exp(theta).vec() - reference_exp(theta).head<3>()).norm(), 1e-15 * scale * angle) << angle;
    }
}

TEST(So3, LogIsAccurateRelativeToTheAngle) {
  Rng rng(3);
  for (const double angle : kAngles)
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d theta = angle * random_direction(rng);
      const Eigen::Quaterniond q(reference_exp(theta));
      EXPECT_LE((so3_log(q) - theta).norm(), 1e-15 * angle) << angle;
    }
}

TEST(So3, LogTakesBothSignsOfTheQuaternion) {
  Rng rng(4);
  for (const double angle : kAngles) {
    const Eigen::Quaterniond q = so3_exp(angle * random_direction(rng));
    EXPECT_EQ(so3_log(q), so3_log(Eigen::Quaterniond(-q.coeffs()))) << angle;
  }
}

TEST(So3, LogAtPiHasLengthPi) {
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Quaterniond q(0.0, 0.0, 0.0, 0.0);
    q.vec()[axis] = 1.0;
    EXPECT_DOUBLE_EQ(so3_log(q).norm(), kPi);
  }
}

TEST(So3, LogBearsTheNormErrorThatFilesHave) {
  Rng rng(5);
  for (const double angle : kAngles) {
    const Eigen::Quaterniond q = so3_exp(angle * random_direction(rng));
    EXPECT_TRUE(matrix_near(so3_log(Eigen::Quaterniond(q.coeffs() * (1.0 + 1e-6))), so3_log(q), 1e-12)) << angle;
  }
}

RC_GTEST_PROP(So3, ExpOfLogIsTheSameRotation, (std::uint64_t seed)) {
  Rng rng(seed);
  const Eigen::Quaterniond q = test::random_rotation(rng);
  RC_ASSERT(matrix_near(so3_exp(so3_log(q)).toRotationMatrix(), q.toRotationMatrix(), 2e-15));
}

RC_GTEST_PROP(So3, ExpMatchesRodrigues, (std::uint64_t seed)) {
  Rng rng(seed);
  const Eigen::Vector3d axis = random_direction(rng);
  const double angle = rng.uniform(-10.0, 10.0);
  RC_ASSERT(
      matrix_near(so3_exp(angle * axis).toRotationMatrix(), Eigen::AngleAxisd(angle, axis).toRotationMatrix(), 1e-14));
}

TEST(So3, RightJacobianIsAccurateAtEveryAngle) {
  Rng rng(6);
  for (const double angle : kAngles)
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d theta = angle * random_direction(rng);
      EXPECT_TRUE(matrix_near(so3_right_jacobian(theta), reference_right_jacobian(theta), 1e-15)) << angle;
      EXPECT_TRUE(matrix_near(so3_right_jacobian_inverse(theta), reference_right_jacobian(theta).inverse(), 4e-15))
          << angle;
    }
}

// The meaning of the Jacobians, by central differences: Exp(theta)^-1 Exp(theta + d) ~ Exp(Jr d).
TEST(So3, JacobiansMatchDifferences) {
  Rng rng(7);
  const double h = 1e-5;
  for (const double angle : kAngles) {
    const Eigen::Vector3d theta = angle * random_direction(rng);
    Eigen::Matrix3d jacobian;
    Eigen::Matrix3d inverse;
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(k);
      jacobian.col(k) = so3_log(so3_exp(theta - d).conjugate() * so3_exp(theta + d)) / (2.0 * h);
    }
    EXPECT_TRUE(matrix_near(so3_right_jacobian(theta), jacobian, 1e-9)) << angle;
    if (angle > kPi - 1e-2) continue;  // Log jumps at pi
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(k);
      inverse.col(k) = (so3_log(so3_exp(theta) * so3_exp(d)) - so3_log(so3_exp(theta) * so3_exp(-d))) / (2.0 * h);
    }
    EXPECT_TRUE(matrix_near(so3_right_jacobian_inverse(theta), inverse, 1e-9)) << angle;
  }
}

RC_GTEST_PROP(So3, ProjectionIsTheClosestRotation, (std::uint64_t seed)) {
  Rng rng(seed);
  Eigen::Matrix3d m;
  for (int i = 0; i < 9; ++i) m(i) = rng.normal();
  const Eigen::Matrix3d R = project_to_so3(m);
  RC_ASSERT(matrix_near(R * R.transpose(), Eigen::Matrix3d::Identity(), 1e-14));
  RC_ASSERT(std::abs(R.determinant() - 1.0) < 1e-14);
  for (int i = 0; i < 20; ++i) {  // no rotation, near or far, is closer
    const Eigen::Matrix3d other = R * test::random_rotation(rng, i < 10 ? 0.01 : kPi).toRotationMatrix();
    RC_ASSERT((m - R).norm() <= (m - other).norm() + 1e-12);
  }
}

}  // namespace so3_test
}  // namespace tutti
