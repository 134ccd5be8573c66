// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/p3p.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "support/random_pose.hpp"

namespace tutti::visual {
namespace p3p_test {

struct Scene {
  Pose3 T_camera_map;
  std::array<Eigen::Vector3d, 3> directions, points;
};
Scene random_scene(Rng& rng) {
  Scene out{.T_camera_map = tutti::test::random_pose(rng, 5.0)};
  for (std::size_t i = 0; i < 3; ++i) {
    const double depth = rng.uniform(0.5, 10.0);
    const Eigen::Vector3d p_camera{depth * rng.uniform(-1.0, 1.0), depth * rng.uniform(-1.0, 1.0), depth};
    out.points[i] = out.T_camera_map.inverse() * p_camera;
    out.directions[i] = p_camera.normalized();
  }
  return out;
}

RC_GTEST_PROP(P3p, everySolutionSeesThePointsAndOneIsTheTruth, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const Scene scene = random_scene(rng);
  const auto solutions = p3p(scene.directions, scene.points);
  RC_ASSERT(solutions.size() <= 4U);
  double nearest = 1e9;
  for (const Pose3& T : solutions) {
    for (std::size_t i = 0; i < 3; ++i)
      RC_ASSERT(((T * scene.points[i]).normalized() - scene.directions[i]).norm() < 1e-5);
    nearest = std::min(nearest, local(scene.T_camera_map, T).norm());
  }
  RC_ASSERT(nearest < 1e-3);  // where two solutions nearly coincide, half of the digits are lost
}

TEST(P3p, nearlyAlwaysFindsTheTruthToManyDigits) {
  Rng rng(1);
  int found = 0;
  for (int i = 0; i < 1000; ++i) {
    const Scene scene = random_scene(rng);
    for (const Pose3& T : p3p(scene.directions, scene.points))
      if (local(scene.T_camera_map, T).norm() < 1e-8) {
        ++found;
        break;
      }
  }
  EXPECT_GT(found, 990);
}

TEST(P3p, pointsOnALineGiveNothing) {
  const std::array<Eigen::Vector3d, 3> points{{{0, 0, 3}, {1, 0, 3}, {2, 0, 3}}};
  std::array<Eigen::Vector3d, 3> directions;
  for (std::size_t i = 0; i < 3; ++i) directions[i] = points[i].normalized();
  EXPECT_TRUE(p3p(directions, points).empty());
  EXPECT_TRUE(p3p(directions, {points[0], points[0], points[0]}).empty());
}

}  // namespace p3p_test
}  // namespace tutti::visual
