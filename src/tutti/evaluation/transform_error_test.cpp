// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/transform_error.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "tutti/geometry/so3.hpp"

namespace tutti::evaluation {
namespace transform_error_test {

TEST(TransformError, IsMeasuredWhereTheRobotWas) {
  const double angle = 0.01;
  const Eigen::Vector3d point_b(50, 0, 0);
  const Pose3 reference{so3_exp({0, 0, 1.0}), {5, 6, 7}};
  // Turned about the point: far off at the origin of b, exact at the point.
  const Pose3 about{so3_exp({0, 0, angle}), point_b - so3_exp({0, 0, angle}) * point_b};
  const auto at_point = transform_error(reference * about, reference, point_b);
  EXPECT_NEAR(at_point.translation_m, 0.0, 1e-12);
  EXPECT_NEAR(at_point.rotation_deg, angle * 180.0 / std::numbers::pi, 1e-9);
  const auto at_origin = transform_error(reference * about, reference, Eigen::Vector3d::Zero());
  EXPECT_NEAR(at_origin.translation_m, 2 * 50 * std::sin(0.5 * angle), 1e-9);
}

TEST(TransformError, ZeroForTheReferenceItself) {
  const Pose3 T{so3_exp({0.1, 0.2, 3.0}), {5, 6, 7}};
  const auto error = transform_error(T, T, {1, 2, 3});
  EXPECT_EQ(error.translation_m, 0.0);
  EXPECT_LT(error.rotation_deg, 1e-6);
}

TEST(Centroid, MeanPositionOrNothing) {
  EXPECT_FALSE(centroid({}));
  const Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  EXPECT_EQ(*centroid({{{0}, {q, {1, 2, 3}}}, {{1}, {q, {3, 2, -3}}}}), Eigen::Vector3d(2, 2, 0));
}

}  // namespace transform_error_test
}  // namespace tutti::evaluation
