// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/projection_factor.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "support/random_pose.hpp"

namespace tutti::bundle {
namespace projection_factor_test {

using namespace test;

Camera random_camera(Rng& rng) {
  Camera camera{.model = {.kind = static_cast<CameraKind>(rng.index(3)),
                          .width_px = 752,
                          .height_px = 480,
                          .fx = 450.0,
                          .fy = 440.0,
                          .cx = 370.0,
                          .cy = 250.0,
                          .distortion = {-0.1, 0.05, 1e-3, -1e-3}},
                .T_body_camera = random_pose(rng, 0.1)};
  if (camera.model.kind == CameraKind::double_sphere) camera.model.distortion = {-0.2, 0.6, 0.0, 0.0};
  return camera;
}

RC_GTEST_PROP(ProjectionFactor, JacobiansAreTheDerivatives, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const Camera camera = random_camera(rng);
  const Pose3 T = random_pose(rng);
  const double depth = rng.uniform(1.0, 8.0);
  const Eigen::Vector3d p_camera(depth * rng.uniform(-0.6, 0.6), depth * rng.uniform(-0.4, 0.4), depth);
  const Eigen::Vector3d p = T * (camera.T_body_camera * p_camera);
  const Eigen::Vector2d pixel(rng.uniform(0.0, 752.0), rng.uniform(0.0, 480.0));
  const auto at = linearise_projection(camera, T, p, pixel, 0.7);
  RC_ASSERT(at.has_value());
  RC_ASSERT(matrix_near(at->residual, *reprojection_error(camera, T, p, pixel) / 0.7, 1e-9));
  constexpr double h = 1e-6;
  Eigen::Matrix<double, 2, 6> by_pose;
  for (int i = 0; i < 6; ++i) {
    const Vector6d d = h * Vector6d::Unit(i);
    by_pose.col(i) =
        (*reprojection_error(camera, retract(T, d), p, pixel) - *reprojection_error(camera, retract(T, -d), p, pixel)) /
        (2.0 * h * 0.7);
  }
  Eigen::Matrix<double, 2, 3> by_landmark;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(i);
    by_landmark.col(i) =
        (*reprojection_error(camera, T, p + d, pixel) - *reprojection_error(camera, T, p - d, pixel)) / (2.0 * h * 0.7);
  }
  const double scale = 1.0 + by_pose.norm();
  RC_ASSERT(matrix_near(at->J_pose, by_pose, 1e-6 * scale));
  RC_ASSERT(matrix_near(at->J_landmark, by_landmark, 1e-6 * scale));
}

TEST(ProjectionFactor, NothingBehindTheCamera) {
  const Camera camera{.model = {.width_px = 752, .height_px = 480, .fx = 450, .fy = 450, .cx = 370, .cy = 250},
                      .T_body_camera = {}};
  EXPECT_FALSE(linearise_projection(camera, {}, {0.1, 0.1, -1.0}, {0.0, 0.0}, 1.0));
}

TEST(ProjectionFactor, StatisticsPerCamera) {
  const CameraModel model{.width_px = 752, .height_px = 480, .fx = 400, .fy = 400, .cx = 370, .cy = 250};
  BundleProblem problem{.keyframes = {{}}, .cameras = {{RobotId{1}, 0, {model, {}}}, {RobotId{2}, 3, {model, {}}}}};
  for (int i = 0; i < 11; ++i) {  // off by 0 to 10 px
    problem.landmarks.push_back({0.0, 0.0, 4.0});
    problem.observations.push_back({0, 0, problem.landmarks.size() - 1, {370.0 + i, 250.0}, 1.0});
  }
  problem.landmarks.push_back({0.0, 0.0, -4.0});
  problem.observations.push_back({0, 1, problem.landmarks.size() - 1, {370.0, 250.0}, 1.0});
  const auto residuals = camera_residuals(problem);
  ASSERT_EQ(residuals.size(), 2U);
  EXPECT_DOUBLE_EQ(residuals[0].median_px, 5.0);
  EXPECT_DOUBLE_EQ(residuals[0].ninetieth_percentile_px, 9.0);
  EXPECT_EQ(residuals[0].unseen, 0U);
  EXPECT_EQ(residuals[1].robot, RobotId{2});
  EXPECT_EQ(residuals[1].unseen, 1U);
}

}  // namespace projection_factor_test
}  // namespace tutti::bundle
