// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/candidates.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "support/perception/lidar/rooms.hpp"

namespace tutti::lidar {
namespace candidates_test {

using namespace test;

TEST(ProposeAlignments, findsYawShiftAndHeightWhateverTheTilt) {
  const LidarClosureConfig config;
  const Walk walk_a;
  const auto a = extract_features(make_submap({RobotId{0}, 0}, furnished_room(), walk_a, Rng(1)), config);
  Rng rng(7);
  for (int trial = 0; trial < 12; ++trial) {
    Walk walk_b{.from = {rng.uniform(2, 12), rng.uniform(4, 6), rng.uniform(0.8, 1.8)},
                .yaw_rad = rng.uniform(-std::numbers::pi, std::numbers::pi),
                .tilt_rad = rng.uniform(-0.3, 0.3)};
    walk_b.to = walk_b.from + Eigen::Vector3d(1, 0, 0);
    const auto b = extract_features(make_submap({RobotId{1}, 0}, furnished_room(), walk_b, Rng(100 + trial)), config);
    const auto guesses = propose_alignments(a, b, config);
    ASSERT_FALSE(guesses.empty());
    for (std::size_t i = 1; i < guesses.size(); ++i) EXPECT_LE(guesses[i].score, guesses[i - 1].score);
    const Pose3 error = true_relative(walk_a, walk_b).inverse() * guesses.front().T_a_b;
    EXPECT_LT(rotation_angle(error) * 180.0 / std::numbers::pi, 4.0);
    EXPECT_LT(error.translation.norm(), 1.2);
  }
}

TEST(ProposeAlignments, proposeNothingForUnusableSubmaps) {
  const LidarClosureConfig config;
  const auto good = extract_features(make_submap({RobotId{0}, 0}, furnished_room(), {}, Rng(1)), config);
  EXPECT_TRUE(propose_alignments(good, SubmapFeatures{}, config).empty());
  EXPECT_TRUE(propose_alignments(SubmapFeatures{}, good, config).empty());
  EXPECT_FALSE(plausible_pair(good, SubmapFeatures{}));
  EXPECT_TRUE(plausible_pair(good, good));
}

}  // namespace candidates_test
}  // namespace tutti::lidar
