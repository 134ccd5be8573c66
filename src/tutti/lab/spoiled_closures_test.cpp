// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/spoiled_closures.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tutti/geometry/so3.hpp"
#include "tutti/lab/closure_verifiers.hpp"

namespace tutti::lab {
namespace spoiled_closures_test {

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
class Perfect final : public server::ClosureVerifier {
 public:
  [[nodiscard]] MethodId id() const override { return {"perfect", 7, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap&, const Submap&) const override { return true; }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore&) const override {
    const Keyframe& a = first.keyframes[1];
    const Keyframe& b = second.keyframes[1];
    return ClosureVerdict{{first.id, second.id},
                          {{{first.id.chain, a.index},
                            {second.id.chain, b.index},
                            {a.T_odom_body.inverse() * b.T_odom_body, Matrix6d::Identity()}}},
                          std::nullopt,
                          id()};
  }
};

class Spoiled : public testing::Test {
 protected:
  /// Claimed pose of the second submap from the true one, seen from the block's shared keyframe of the first.
  Pose3 error(std::uint32_t i, std::uint32_t j, std::uint64_t seed = 1) const {
    const SpoiledClosureVerifier verifier(std::make_shared<Perfect>(), 0.3, config_, seed);
    const Submap first = submap(0, i);
    const Submap second = submap(1, j);
    const LoopClosure closure = verifier.verify(first, second, payloads_)->closures.at(0);
    const Pose3 T_odom_claimed = first.keyframes[1].T_odom_body * closure.measurement.T_a_b;
    const Pose3& anchor = first.keyframes[i % 2 == 0 ? 2 : 0].T_odom_body;
    return anchor.inverse() * T_odom_claimed * second.keyframes[1].T_odom_body.inverse() * anchor;
  }
  SpoiledClosureConfig config_;
  server::MemoryPayloadStore payloads_;
};

TEST_F(Spoiled, TheShareIsWrongByWhatWasAskedFor) {
  int wrong = 0;
  for (std::uint32_t i = 0; i < 40; ++i)
    for (std::uint32_t j = 0; j < 40; ++j) {
      const double offset = error(i, j).translation.norm();
      if (offset < 1e-9) continue;
      ++wrong;
      EXPECT_GE(offset, simulation::kWrongLeast_m - 1e-9);
      EXPECT_LE(offset, simulation::kWrongMost_m + 1e-9);
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

/// Two robots 2 m apart, whose odometry is the truth; a wrong closure between robot 1 at 21.2 s and robot 0 at 4.9 s.
class Planted : public testing::Test {
 protected:
  Planted() {
    std::map<RobotId, Trajectory> reference;
    for (std::uint32_t robot = 0; robot < 2; ++robot)
      for (std::uint32_t index = 0; index < 20; ++index)
        for (const Keyframe& keyframe : submap(robot, index).keyframes)
          if (reference[RobotId{robot}].empty() || reference[RobotId{robot}].back().stamp < keyframe.stamp)
            reference[RobotId{robot}].push_back({keyframe.stamp, keyframe.T_odom_body});
    verifier_ = std::make_shared<ReferenceClosureVerifier>(
        reference, simulation::ReferenceClosureConfig{.radius_m = 1e-3, .wrong_share = 0.0}, 1,
        std::vector<PlantedClosure>{{RobotId{1}, Timestamp{} + 21.2, RobotId{0}, Timestamp{} + 4.9, error_}});
  }
  const Pose3 error_{so3_exp({0.0, 0.0, 0.1}), {1.5, -0.5, 0.0}};
  server::MemoryPayloadStore payloads_;
  std::shared_ptr<ReferenceClosureVerifier> verifier_;
};

TEST_F(Planted, OnePairOfSubmapsHasTheWrongClosure) {
  int found = 0;
  for (std::uint32_t i = 0; i < 20; ++i)
    for (std::uint32_t j = 0; j < 20; ++j) {
      const auto verdict = verifier_->verify(submap(0, i), submap(1, j), payloads_);
      EXPECT_EQ(verifier_->is_candidate(submap(0, i), submap(1, j)), !verdict->closures.empty());
      EXPECT_EQ(verdict->refusal.has_value(), verdict->closures.empty());
      EXPECT_EQ(verdict->verifier, verifier_->id());
      if (verdict->closures.empty()) continue;
      ++found;
      const LoopClosure& closure = verdict->closures.front();
      EXPECT_EQ(closure.from, (KeyframeId{RobotId{0}, 5}));
      EXPECT_EQ(closure.to, (KeyframeId{RobotId{1}, 21}));
      const Pose3 T_true{Eigen::Quaterniond::Identity(), {16.0, 2.0, 0.0}};
      EXPECT_LT(local(error_ * T_true, closure.measurement.T_a_b).norm(), 1e-9);
    }
  EXPECT_EQ(found, 1);
}

TEST_F(Planted, TheOrderOfThePairOnlyInvertsTheClosure) {
  const LoopClosure forth = verifier_->verify(submap(0, 2), submap(1, 10), payloads_)->closures.at(0);
  const LoopClosure back = verifier_->verify(submap(1, 10), submap(0, 2), payloads_)->closures.at(0);
  EXPECT_EQ(back.from, forth.to);
  EXPECT_EQ(back.to, forth.from);
  EXPECT_LT(local(back.measurement.T_a_b, forth.measurement.T_a_b.inverse()).norm(), 1e-9);
}

}  // namespace spoiled_closures_test
}  // namespace tutti::lab
