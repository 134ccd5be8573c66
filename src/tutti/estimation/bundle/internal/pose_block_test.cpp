// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/internal/pose_block.hpp"

#include <ceres/manifold.h>
#include <ceres/manifold_test_utils.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/random_pose.hpp"

namespace tutti::bundle::internal {
namespace pose_block_test {

/// The manifold that the adjuster gives to Ceres.
class OurManifold final : public ceres::Manifold {
 public:
  [[nodiscard]] int AmbientSize() const override { return 7; }
  [[nodiscard]] int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* out) const override {
    write_pose(retract(pose_of(x), Eigen::Map<const Vector6d>(delta)), out);
    return true;
  }
  bool Minus(const double* y, const double* x, double* out) const override {
    Eigen::Map<Vector6d>{out} = local(pose_of(x), pose_of(y));
    return true;
  }
  bool PlusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<internal::PlusJacobian>{jacobian} = plus_jacobian(x);
    return true;
  }
  bool MinusJacobian(const double* x, double* jacobian) const override {
    Eigen::Map<internal::MinusJacobian>{jacobian} = minus_jacobian(x);
    return true;
  }
};

TEST(PoseBlock, IsAManifold) {
  using namespace ceres;  // for the macro below
  using namespace testing;
  Rng rng(1);
  const OurManifold manifold;
  for (int k = 0; k < 20; ++k) {
    const Pose3 T = test::random_pose(rng);
    const Pose3 other = retract(T, test::random_tangent(rng, 0.7));  // same sign of the quaternion
    Eigen::VectorXd x(7), y(7);
    write_pose(T, x.data());
    write_pose(other, y.data());
    const Eigen::VectorXd delta = test::random_tangent(rng, 0.7);
    EXPECT_THAT_MANIFOLD_INVARIANTS_HOLD(manifold, x, delta, y, 1e-9);
    EXPECT_TRUE(test::pose_near(pose_of(x.data()), T, 0.0));
    EXPECT_TRUE(test::matrix_near(minus_jacobian(x.data()) * plus_jacobian(x.data()), Matrix6d::Identity(), 1e-12));
  }
}

}  // namespace pose_block_test
}  // namespace tutti::bundle::internal
