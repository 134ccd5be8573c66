// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/spoiled_closures.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tutti::mission {
namespace {

/// Submaps of three keyframes along a line; two robots side by side.
Submap submap(std::uint32_t robot, std::uint32_t index) {
  Submap out{.id = {RobotId{robot}, index}};
  for (std::uint32_t k = 0; k < 3; ++k) {
    const std::uint32_t keyframe = 2 * index + k;
    out.keyframes.push_back({keyframe,
                             Timestamp{1'000'000'000 * std::int64_t{keyframe}},
                             {Eigen::Quaterniond::Identity(), {1.0 * keyframe, 2.0 * robot, 0.0}}});
  }
  return out;
}

/// Finds every pair, between the middle keyframes, exactly.
class Perfect final : public server::ClosureFinder {
 public:
  [[nodiscard]] bool needs_clouds() const override { return false; }
  [[nodiscard]] bool is_candidate(const Submap&, const Submap&) const override { return true; }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::CloudStore&) const override {
    const Keyframe& a = first.keyframes[1];
    const Keyframe& b = second.keyframes[1];
    return ClosureVerdict{{first.id, second.id},
                          {{{first.id.robot, a.index},
                            {second.id.robot, b.index},
                            {a.T_odom_body.inverse() * b.T_odom_body, Matrix6d::Identity()}}},
                          std::string()};
  }
};

class Spoiled : public testing::Test {
 protected:
  /// Claimed pose of the second submap from the true one, seen from the block's shared keyframe of the first.
  Pose3 error(std::uint32_t i, std::uint32_t j, std::uint64_t seed = 1) const {
    const SpoiledClosureFinder finder(std::make_shared<Perfect>(), 0.3, config_, seed);
    const Submap first = submap(0, i);
    const Submap second = submap(1, j);
    const LoopClosure closure = finder.verify(first, second, clouds_)->closures.at(0);
    const Pose3 T_odom_claimed = first.keyframes[1].T_odom_body * closure.measurement.T_a_b;
    const Pose3& anchor = first.keyframes[i % 2 == 0 ? 2 : 0].T_odom_body;
    return anchor.inverse() * T_odom_claimed * second.keyframes[1].T_odom_body.inverse() * anchor;
  }
  SpoiledClosureConfig config_;
  server::MemoryCloudStore clouds_;
};

TEST_F(Spoiled, TheShareIsWrongByWhatWasAskedFor) {
  int wrong = 0;
  for (std::uint32_t i = 0; i < 40; ++i)
    for (std::uint32_t j = 0; j < 40; ++j) {
      const double offset = error(i, j).translation.norm();
      if (offset < 1e-9) continue;
      ++wrong;
      EXPECT_GE(offset, config_.min_m - 1e-9);
      EXPECT_LE(offset, config_.max_m + 1e-9);
    }
  EXPECT_NEAR(wrong / 1600.0, 0.3, 0.06);
}

TEST_F(Spoiled, AgreeingOnesShareTheirErrorOverABlock) {
  config_.agreeing_share = 1.0;
  int wrong = 0;
  for (std::uint32_t i = 0; i < 40; i += 2)
    for (std::uint32_t j = 0; j < 40; j += 2) {
      const Pose3 block = error(i, j);
      wrong += block.translation.norm() > 1e-9 ? 1 : 0;
      EXPECT_LT(local(block, error(i + 1, j + 1)).norm(), 1e-9);
    }
  EXPECT_GT(wrong, 60);
}

TEST_F(Spoiled, WhichOnesDependsOnTheSeedAlone) {
  EXPECT_EQ(error(3, 5, 7), error(3, 5, 7));
  int differ = 0;
  for (std::uint32_t i = 0; i < 40; ++i) differ += error(i, i, 1) == error(i, i, 2) ? 0 : 1;
  EXPECT_GT(differ, 5);
}

}  // namespace
}  // namespace tutti::mission
