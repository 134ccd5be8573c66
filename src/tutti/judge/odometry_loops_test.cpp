// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/odometry_loops.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdlib>

#include "support/random_pose.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::judge {
namespace odometry_loops_test {

constexpr std::uint32_t kKeyframes = 60;
constexpr RobotId kOne{0}, kTwo{1};

RelativePose measured(const Pose3& truth, double sigma_m, double sigma_rad, Rng& rng) {
  return {retract(truth, test::draw(rng, sigma_m, sigma_rad)), diagonal_covariance(sigma_m, sigma_rad)};
}

/// Two robots on one winding trajectory, the second a metre beside the first.
struct Walk {
  std::vector<OdometrySegment> segments;
  std::vector<Pose3> truth;  ///< T_world_body of both, one after the other.

  Walk(double sigma_m, double sigma_rad, Rng& rng) {
    for (const RobotId robot : {kOne, kTwo}) {
      OdometrySegment chain{.id = robot};
      Pose3 T_world_body{Eigen::Quaterniond::Identity(), {0, 1.0 * robot.value, 0}};
      for (std::uint32_t k = 0; k < kKeyframes; ++k) {
        if (k > 0) {
          const Pose3 step{so3_exp(Eigen::Vector3d(0.02, 0, 0.1)), Eigen::Vector3d(1, 0, 0)};
          const RelativePose odometry = measured(step, sigma_m, sigma_rad, rng);
          T_world_body = T_world_body * step;
          chain.T_odom_body.push_back(chain.T_odom_body.back() * odometry.T_a_b);
          chain.step_covariance.push_back(odometry.covariance);
        } else {
          chain.T_odom_body.push_back({so3_exp(Eigen::Vector3d(0.1, 0.2, 0.3)), {5, 6, 7}});
        }
        chain.index.push_back(k);
        truth.push_back(T_world_body);
      }
      segments.push_back(std::move(chain));
    }
  }

  [[nodiscard]] LoopClosure closure(KeyframeId from, KeyframeId to, double sigma_m, double sigma_rad, Rng& rng) const {
    const auto pose = [&](KeyframeId id) { return truth[id.chain.robot.value * kKeyframes + id.index]; };
    return {from, to, measured(pose(from).inverse() * pose(to), sigma_m, sigma_rad, rng)};
  }
};

TEST(OdometryLoops, CloseWithoutNoise) {
  Rng rng(1);
  const Walk walk(0.0, 0.0, rng);
  const std::vector<LoopClosure> closures{walk.closure({kOne, 50}, {kOne, 3}, 0, 0, rng),
                                          walk.closure({kOne, 5}, {kTwo, 40}, 0, 0, rng),
                                          walk.closure({kTwo, 10}, {kOne, 55}, 0, 0, rng)};
  const auto loops = odometry_loops(walk.segments, closures);
  EXPECT_EQ(loops.at(kOne).size(), 2U);
  EXPECT_EQ(loops.at(kTwo).size(), 1U);
  for (const auto& [robot, of_robot] : loops)
    for (const OdometryLoop& loop : of_robot) EXPECT_LT(loop.missed.norm(), 1e-12);
}

TEST(OdometryLoops, MissByWhatTheirCovarianceSays) {
  constexpr int kRuns = 400;
  double alone = 0.0, together = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    Rng rng(static_cast<std::uint64_t>(run));
    const Walk walk(0.01, 0.002, rng);
    const std::vector<LoopClosure> closures{walk.closure({kOne, 2}, {kOne, 50}, 0.02, 0.01, rng),
                                            walk.closure({kTwo, 40}, {kOne, 5}, 0.02, 0.01, rng),
                                            walk.closure({kOne, 30}, {kTwo, 10}, 0.02, 0.01, rng)};
    const auto square = [](const OdometryLoop& loop) {
      return squared_distance(loop.missed, loop.odometry + loop.closures);
    };
    const auto loops = odometry_loops(walk.segments, closures);
    alone += square(loops.at(kOne).front()) / kRuns;
    together += square(loops.at(kTwo).front()) / kRuns;
  }
  EXPECT_NEAR(alone, 6.0, 0.6);  // sigma of the mean: sqrt(12 / 400) = 0.17
  EXPECT_NEAR(together, 6.0, 0.6);
}

TEST(OdometryLoops, NotOverAGap) {
  Rng rng(2);
  Walk walk(0.01, 0.002, rng);
  const std::vector<LoopClosure> closures{walk.closure({kOne, 5}, {kOne, 45}, 0.02, 0.01, rng),
                                          walk.closure({kOne, 35}, {kOne, 50}, 0.02, 0.01, rng)};
  OdometrySegment& all = walk.segments.front();
  OdometrySegment late{.id = kOne};
  late.index.assign(all.index.begin() + 30, all.index.end());
  late.T_odom_body.assign(all.T_odom_body.begin() + 30, all.T_odom_body.end());
  late.step_covariance.assign(all.step_covariance.begin() + 30, all.step_covariance.end());
  all.index.resize(20);
  all.T_odom_body.resize(20);
  all.step_covariance.resize(19);
  walk.segments.push_back(late);
  const auto loops = odometry_loops(walk.segments, closures);
  ASSERT_EQ(loops.at(kOne).size(), 1U);
  EXPECT_NEAR(loops.at(kOne).front().odometry(5, 5), 15 * 0.002 * 0.002, 1e-9);
}

TEST(OdometryLoops, OverAStepThatLeavesKeyframesOut) {
  Rng rng(3);
  Walk walk(0.0, 0.0, rng);
  const std::vector<LoopClosure> closures{walk.closure({kOne, 5}, {kOne, 45}, 0, 0, rng),
                                          walk.closure({kOne, 25}, {kOne, 50}, 0, 0, rng)};
  OdometrySegment& all = walk.segments.front();
  const Matrix6d nine = 9 * all.step_covariance[20];
  all.index.erase(all.index.begin() + 21, all.index.begin() + 29);  // from 20 to 29 in one step
  all.T_odom_body.erase(all.T_odom_body.begin() + 21, all.T_odom_body.begin() + 29);
  all.step_covariance.erase(all.step_covariance.begin() + 21, all.step_covariance.begin() + 29);
  all.step_covariance[20] = nine;
  const auto loops = odometry_loops(walk.segments, closures);
  ASSERT_EQ(loops.at(kOne).size(), 1U) << "no keyframe 25 is there";
  EXPECT_LT(loops.at(kOne).front().missed.norm(), 1e-9);
}

/// A covariance between two keyframes is the difference of two that have grown along the whole trajectory: 0.08 % are
/// lost here.
TEST(OdometryLoops, AreAsCertainAfterADayByCarAsAtItsBegin) {
  constexpr std::uint32_t kSteps = 40'000;
  constexpr double kStep_m = 20.0;
  const Pose3 step{so3_exp(Eigen::Vector3d(0, 0, 1e-5)), Eigen::Vector3d(kStep_m, 0, 0)};
  OdometrySegment day{.id = kOne, .index = {0}, .T_odom_body = {Pose3{}}};
  for (std::uint32_t k = 0; k < kSteps; ++k) {
    day.index.push_back(k + 1);
    day.T_odom_body.push_back(day.T_odom_body.back() * step);
    day.step_covariance.push_back(diagonal_covariance(0.01, 1e-3));
  }
  ASSERT_GT(day.T_odom_body.back().translation.norm(), 500e3);
  std::vector<LoopClosure> closures;
  for (const std::uint32_t from : {0U, kSteps - 5})
    closures.push_back({{kOne, from}, {kOne, from + 5}, {Pose3{}, diagonal_covariance(0.1, 0.1)}});
  const auto loops = odometry_loops(std::span(&day, 1), closures).at(kOne);
  ASSERT_EQ(loops.size(), 2U);
  const Eigen::LLT<Matrix6d> begin(loops[0].odometry);
  const Matrix6d ratio = begin.matrixL().solve(begin.matrixL().solve(loops[1].odometry).transpose());
  EXPECT_LT((ratio - Matrix6d::Identity()).norm(), 0.01) << ratio;
}

TEST(NeighbouringClosures, AreTheNearestOfAll) {
  Rng rng(4);
  const Walk walk(0.01, 0.002, rng);
  for (const RobotId other : {kOne, kTwo}) {
    std::vector<LoopClosure> closures;
    for (int k = 0; k < 60; ++k) {
      const auto a = static_cast<std::uint32_t>(rng.index(30)), b = 30 + static_cast<std::uint32_t>(rng.index(30));
      closures.push_back(walk.closure({kOne, a}, {other, b}, 0.02, 0.01, rng));
    }
    const auto apart = [](const LoopClosure& a, const LoopClosure& b) {
      const auto away = [](KeyframeId one, KeyframeId two) { return std::abs(int(one.index) - int(two.index)); };
      return std::max(away(a.from, b.from), away(a.to, b.to));
    };
    const auto pairs = neighbouring_closures(walk.segments, closures).at({kOne, other});
    EXPECT_LT(pairs.size(), closures.size());  // each pair once
    const auto has = [&](const LoopClosure& closure, int least) {
      return std::ranges::any_of(pairs, [&](const ClosurePair& pair) {
        const bool is_of = (pair.first.from == closure.from && pair.first.to == closure.to) ||
                           (pair.second.from == closure.from && pair.second.to == closure.to);
        return is_of && apart(pair.first, pair.second) == least;
      });
    };
    for (const LoopClosure& closure : closures) {
      int least = kKeyframes;
      for (const LoopClosure& of : closures)
        if (const int away = apart(closure, of); away > 0) least = std::min(least, away);
      EXPECT_TRUE(has(closure, least));
    }
  }
}

TEST(OdometryLoops, EveryRobotIsThere) {
  Rng rng(3);
  const auto loops = odometry_loops(Walk(0.01, 0.002, rng).segments, {});
  ASSERT_EQ(loops.size(), 2U);
  EXPECT_TRUE(loops.at(kTwo).empty());
}

}  // namespace odometry_loops_test
}  // namespace tutti::judge
