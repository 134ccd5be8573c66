// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/transform_tree.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::bags {
namespace transform_tree_test {

/// tf2's own bounds, to the rounding of a double.
TEST(TransformTree, QuaternionsOfNorm099AreNormalised) {
  for (const double norm : {0.99, 1.01}) {
    const Eigen::Quaterniond turned(0.6 * norm, 0.0, 0.0, 0.8 * norm);
    const auto pose = to_pose({0, 0, 0}, turned);
    ASSERT_TRUE(pose) << pose.error().message;
    EXPECT_NEAR(pose->rotation.norm(), 1.0, 1e-12);
  }
  EXPECT_FALSE(to_pose({0, 0, 0}, Eigen::Quaterniond(0.985, 0, 0, 0)));
}

RosTransform transform(const std::string& parent, const std::string& child, const Pose3& pose) {
  return {{Timestamp{1}, parent}, child, pose.translation, pose.rotation};
}

TEST(TransformTree, ChainsLeadUpAndDown) {
  Rng rng(3);
  const auto any = [&] {
    return Pose3{so3_exp(Eigen::Vector3d(rng.normal(1.0), rng.normal(1.0), rng.normal(1.0))),
                 {rng.normal(1.0), rng.normal(1.0), rng.normal(1.0)}};
  };
  const Pose3 T_base_mast = any(), T_mast_lidar = any(), T_base_camera = any();
  TransformTree tree;
  ASSERT_TRUE(tree.add(transform("/base", "mast", T_base_mast), true));
  ASSERT_TRUE(tree.add(transform("mast", "/lidar", T_mast_lidar), true));
  ASSERT_TRUE(tree.add(transform("base", "camera", T_base_camera), true));
  const auto expect = [&](const char* to, const char* from, const Pose3& expected) {
    const auto found = tree.find(to, from);
    ASSERT_TRUE(found);
    EXPECT_LT(local(expected, *found).norm(), 1e-9);
  };
  expect("base", "lidar", T_base_mast * T_mast_lidar);
  expect("lidar", "base", (T_base_mast * T_mast_lidar).inverse());
  expect("camera", "lidar", T_base_camera.inverse() * T_base_mast * T_mast_lidar);
  expect("elsewhere", "elsewhere", Pose3{});
  EXPECT_FALSE(tree.find("base", "elsewhere"));
  EXPECT_LT(local(*tree.find("base", "lidar"), *tree.pose("/base", "/lidar")).norm(), 1e-9);
  EXPECT_EQ(tree.pose("base", "/elsewhere", " on /tf").error().message,
            "no transform from 'elsewhere' to 'base' on /tf, frames that do not move are: base, camera, lidar, mast");
  EXPECT_EQ(tree.frames(), "base, camera, lidar, mast");
}

TEST(TransformTree, WhatMovesDoesNotLeadAnywhere) {
  TransformTree tree;
  const Pose3 here, there{Eigen::Quaterniond::Identity(), {0, 0, 0.1}};
  for (const Pose3& pose : {here, here, here}) ASSERT_TRUE(tree.add(transform("base", "fixed", pose), false));
  for (const Pose3& pose : {here, there}) ASSERT_TRUE(tree.add(transform("base", "arm", pose), false));
  EXPECT_TRUE(tree.find("base", "fixed"));
  EXPECT_FALSE(tree.find("base", "arm"));
}

TEST(TransformTree, ContradictionsAreErrorsAndTheFirstCounts) {
  TransformTree tree;
  const Pose3 here, there{Eigen::Quaterniond::Identity(), {0, 0, 0.1}};
  ASSERT_TRUE(tree.add(transform("odom", "base", here), false));
  EXPECT_EQ(tree.add(transform("map", "base", there), false).error().message,
            "frame 'base' has two parents, 'odom' and 'map': the first counts");
  ASSERT_TRUE(tree.add(transform("base", "lidar", here), true));
  ASSERT_TRUE(tree.add(transform("base", "lidar", here), true));
  EXPECT_FALSE(tree.add(transform("base", "lidar", there), true));
  EXPECT_EQ(tree.find("base", "lidar")->translation.z(), 0.0);
  EXPECT_EQ(tree.add(transform("base", "lidar", there), false).error().message,
            "frame 'lidar' in 'base' is static, and moves");
  EXPECT_EQ(tree.problems().size(), 3U);

  TransformTree other;
  ASSERT_TRUE(other.add(transform("base", "camera", there), true));
  ASSERT_TRUE(other.add(transform("mast", "lidar", here), true));
  tree.merge(other);
  EXPECT_TRUE(tree.find("base", "camera"));
  EXPECT_EQ(tree.problems().size(), 4U);
}

TEST(TransformTree, ASensorTensOfMetresAwayIsDoubted) {
  EXPECT_EQ(doubt_of_place({Eigen::Quaterniond::Identity(), {300.0, 0.0, 400.0}}),
            "500.0 m from the body's origin, at [300.000 0.000 400.000] m: are these millimetres?");
  EXPECT_EQ(doubt_of_place({Eigen::Quaterniond::Identity(), {3.0, 0.0, 4.0}}), "");
}

TEST(TransformTree, RingsAndPosesThatAreNoneDoNoHarm) {
  TransformTree tree;
  ASSERT_TRUE(tree.add(transform("a", "b", {}), true));
  ASSERT_TRUE(tree.add(transform("b", "a", {}), true));
  EXPECT_FALSE(tree.find("a", "c"));
  EXPECT_TRUE(tree.find("a", "b"));
  Pose3 bad;
  bad.rotation.coeffs() *= 2.0;
  EXPECT_EQ(tree.add(transform("a", "c", bad), true).error().message,
            "transform a -> c: orientation of norm 2, expected 1 within 0.01");
  bad = Pose3{};
  bad.translation.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(tree.add(transform("a", "c", bad), true));
  EXPECT_FALSE(tree.find("a", "c"));
}

}  // namespace transform_tree_test
}  // namespace tutti::bags
