// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/triangulate.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numeric>

#include "support/perception/visual/textured_room.hpp"
#include "tutti/base/chi_square.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::visual {
namespace triangulate_test {

const CameraModel kCamera = test::stereo_cameras().front().model;
const TriangulationConfig kConfig;

/// Cameras 0.2 m apart that look along z, more or less, at a point in front of them.
std::vector<View> views_of(const Eigen::Vector3d& point, int n, double noise_px, Rng& rng) {
  std::vector<View> out;
  for (int i = 0; i < n; ++i) {
    const Pose3 T_submap_camera{so3_exp(0.05 * Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal())),
                                {0.2 * i, 0.05 * rng.normal(), 0.05 * rng.normal()}};
    View view{&kCamera, T_submap_camera.inverse(), Eigen::Vector2d::Zero(), std::max(0.1, noise_px)};
    const auto pixel = project(kCamera, view.T_camera_submap * point);
    EXPECT_TRUE(pixel.has_value());
    view.pixel = *pixel + noise_px * Eigen::Vector2d(rng.normal(), rng.normal());
    out.push_back(view);
  }
  return out;
}

Eigen::Vector3d point_ahead(Rng& rng) {
  return {rng.uniform(-0.5, 0.5), rng.uniform(-0.5, 0.5), rng.uniform(1.5, 5.0)};
}

RC_GTEST_PROP(Triangulate, findsThePointThatPerfectPixelsSee, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const Eigen::Vector3d point = point_ahead(rng);
  const auto found = triangulate(views_of(point, *rc::gen::inRange(2, 8), 0.0, rng), kConfig);
  RC_ASSERT(found.has_value());
  RC_ASSERT((found->position - point).norm() < 1e-6);
}

TEST(Triangulate, covarianceIsWhatTheErrorsAre) {
  Rng rng(1);
  std::vector<double> distances;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d point = point_ahead(rng);
    const auto found = triangulate(views_of(point, 6, 0.5, rng), kConfig);
    ASSERT_TRUE(found.has_value());
    const Eigen::Vector3d error = found->position - point;
    distances.push_back(squared_distance(error, found->covariance));
  }
  const double mean = std::accumulate(distances.begin(), distances.end(), 0.0) / 400;
  EXPECT_GT(mean, 2.2);  // 3 but for the enlargement, which only goes in one direction
  EXPECT_LT(mean, 3.3);
}

TEST(Triangulate, oneWrongViewIsFoundOut) {
  Rng rng(2);
  const Eigen::Vector3d point{0.2, 0.1, 3.0};
  auto views = views_of(point, 6, 0.3, rng);
  views[3].pixel += Eigen::Vector2d(30.0, -20.0);
  const auto found = triangulate(views, kConfig);
  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->fits, (std::vector<bool>{true, true, true, false, true, true}));
  EXPECT_LT((found->position - point).norm(), 0.03);
}

TEST(Triangulate, saysWhyThereIsNoPoint) {
  Rng rng(3);
  const auto far = triangulate(views_of({0.0, 0.0, 300.0}, 4, 0.0, rng), kConfig);
  EXPECT_EQ(far.error(), TriangulationFault::parallax);

  auto apart = views_of({0.0, 0.0, 3.0}, 2, 0.0, rng);
  apart[1].pixel.y() += 40.0;
  EXPECT_EQ(triangulate(apart, kConfig).error(), TriangulationFault::misfit);

  auto diverging = views_of({0.1, 0.0, 3.0}, 2, 0.0, rng);
  std::swap(diverging[0].pixel, diverging[1].pixel);
  EXPECT_EQ(triangulate(diverging, kConfig).error(), TriangulationFault::behind);

  EXPECT_EQ(triangulate({}, kConfig).error(), TriangulationFault::misfit);
}

}  // namespace triangulate_test
}  // namespace tutti::visual
