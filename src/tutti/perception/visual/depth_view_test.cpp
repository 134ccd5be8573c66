// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/depth_view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/perception/visual/triangulate.hpp"

namespace tutti::visual {
namespace depth_view_test {

const Camera kFirst{{CameraKind::pinhole, 640, 480, 525.0, 525.0, 319.5, 239.5, {}},
                    {so3_exp({0.1, -0.2, 0.3}), {0.1, 0.0, 0.2}}};
const DepthSensor kSensor{.unit_m = 1.0 / 5000.0, .sigma_m = 0.0, .sigma_per_m2 = 0.0014};
constexpr double kSigma_px = 0.5;

/// Sees a wall that leans away to the right.
DepthImage wall(double near_m, double far_m) {
  DepthImage out{640, 480, std::vector<std::uint16_t>(640U * 480U)};
  for (std::size_t i = 0; i < out.value.size(); ++i)
    out.value[i] =
        static_cast<std::uint16_t>((near_m + (far_m - near_m) * static_cast<double>(i % 640) / 640.0) / kSensor.unit_m);
  return out;
}

TrackedImage keypoints() {
  TrackedImage out;
  for (int v = 40; v < 480; v += 80)
    for (int u = 40; u < 640; u += 80)
      out.keypoints.push_back({{static_cast<float>(u), static_cast<float>(v)}, static_cast<float>(kSigma_px), 0});
  return out;
}

TEST(DepthView, OneViewDeterminesWhereAPointIs) {
  TrackedImage image = keypoints();
  image.keypoints[3].track = 7;
  const Camera by_depth = depth_camera(kFirst, kSensor, kSigma_px);
  ASSERT_TRUE(check_camera(by_depth.model));
  const TrackedImage view = view_by_depth(image, wall(1.0, 4.0), kSensor, kFirst, by_depth, 100);
  ASSERT_EQ(view.keypoints.size(), image.keypoints.size());
  EXPECT_EQ(view.camera, 1U);
  EXPECT_EQ(view.keypoints[3].track, 7U);
  for (std::size_t i = 0; i < view.keypoints.size(); ++i) {
    EXPECT_EQ(view.keypoints[i].track, image.keypoints[i].track);
    const std::vector<View> views{
        {&kFirst.model, kFirst.T_body_camera.inverse(), image.keypoints[i].pixel.cast<double>(), kSigma_px},
        {&by_depth.model, by_depth.T_body_camera.inverse(), view.keypoints[i].pixel.cast<double>(),
         view.keypoints[i].sigma_px}};
    const auto point = triangulate(views, {});
    ASSERT_TRUE(point.has_value());
    const Eigen::Vector3d seen = kFirst.T_body_camera.inverse() * point->position;
    const double z_m = 1.0 + 3.0 * image.keypoints[i].pixel.x() / 640.0;
    EXPECT_NEAR(seen.z(), z_m, 2e-3);
    // The uncertainty of the depth is the sensor's, within what a second view of the pixel adds.
    const Eigen::Matrix3d covariance = point_information(views, point->position).inverse();
    const Eigen::Vector3d axis = kFirst.T_body_camera.rotation * Eigen::Vector3d::UnitZ();
    EXPECT_NEAR(std::sqrt(axis.dot(covariance * axis)), 0.0014 * z_m * z_m, 0.35 * 0.0014 * z_m * z_m);
  }
}

TEST(DepthView, ErrorsOfDepthAreCoveredByTheirCovariance) {
  Rng rng(3);
  const Camera by_depth = depth_camera(kFirst, kSensor, kSigma_px);
  double chi2 = 0.0;
  int count = 0;
  for (int round = 0; round < 40; ++round) {
    const double z_m = rng.uniform(0.6, 4.5);
    TrackedImage image = keypoints();
    const TrackedImage truth = image;
    for (TrackedKeypoint& it : image.keypoints)
      it.pixel += Eigen::Vector2f(static_cast<float>(rng.normal(kSigma_px)), static_cast<float>(rng.normal(kSigma_px)));
    DepthImage depth = wall(z_m + rng.normal(0.0014 * z_m * z_m), 0.0);
    std::fill(depth.value.begin() + 1, depth.value.end(), depth.value[0]);
    const TrackedImage view = view_by_depth(image, depth, kSensor, kFirst, by_depth, 1);
    ASSERT_EQ(view.keypoints.size(), image.keypoints.size());
    const std::size_t i = rng.index(image.keypoints.size());
    const std::vector<View> views{{&kFirst.model, {}, image.keypoints[i].pixel.cast<double>(), kSigma_px},
                                  {&by_depth.model, (kFirst.T_body_camera.inverse() * by_depth.T_body_camera).inverse(),
                                   view.keypoints[i].pixel.cast<double>(), view.keypoints[i].sigma_px}};
    const auto point = triangulate(views, {});
    ASSERT_TRUE(point.has_value());
    const auto ray = *unproject(kFirst.model, truth.keypoints[i].pixel.cast<double>());
    const Eigen::Vector3d error = point->position - z_m / ray.z() * ray;
    chi2 += error.dot(point_information(views, point->position) * error);
    ++count;
  }
  EXPECT_GT(chi2 / count, 1.5);  // 3 is honest
  EXPECT_LT(chi2 / count, 4.5);
}

TEST(DepthView, NothingAtEdgesHolesAndOutOfRange) {
  const Camera by_depth = depth_camera(kFirst, kSensor, kSigma_px);
  const auto count = [&](const DepthImage& depth) {
    TrackedImage image = keypoints();
    return view_by_depth(image, depth, kSensor, kFirst, by_depth, 1).keypoints.size();
  };
  EXPECT_EQ(count(wall(2.0, 2.0)), keypoints().keypoints.size());
  EXPECT_EQ(count(wall(0.1, 0.1)), 0U);
  EXPECT_EQ(count(wall(9.0, 9.0)), 0U);
  EXPECT_EQ(count(wall(0.0, 0.0)), 0U);  // a hole
  DepthImage edges = wall(2.0, 2.0);
  for (std::size_t i = 0; i < edges.value.size(); ++i)
    if (i % 640 % 80 == 41) edges.value[i] = static_cast<std::uint16_t>(3.0 / kSensor.unit_m);  // beside the keypoints
  EXPECT_EQ(count(edges), 0U);
  EXPECT_FALSE(check_depth_size({320, 240, {}}, kFirst));
  EXPECT_TRUE(check_depth_size({640, 480, {}}, kFirst));
}

}  // namespace depth_view_test
}  // namespace tutti::visual
