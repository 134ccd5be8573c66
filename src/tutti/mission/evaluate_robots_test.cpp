// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "tutti/mission/evaluate.hpp"

namespace tutti::mission {
namespace evaluate_robots_test {

constexpr int kSamples = 41;

Timestamp at(double seconds) { return Timestamp{1'000'000'000'000} + seconds; }

/// Once round a circle of 10 m radius, a metre a second.
Pose3 true_pose(int k) {
  const double angle = 0.1 * k;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
          {10.0 * std::sin(angle), 10.0 * (1.0 - std::cos(angle)), 0.0}};
}

/// One robot with perfect odometry, and the server's map of it: the truth in another frame.
class EvaluateRobots : public ::testing::Test {
 protected:
  void SetUp() override {
    recording_.recording.name = "alpha";
    const Matrix6d covariance = 1e-4 * Matrix6d::Identity();
    for (int k = 0; k < kSamples; ++k) {
      recording_.recording.odometry.push_back({at(k), true_pose(k)});
      recording_.recording.reference.push_back({at(k), true_pose(k)});
      ASSERT_TRUE(agent_.add(OdometrySample{at(k), true_pose(k), covariance}));
    }
    agent_.finish();
    std::uint32_t index = 0;
    for (const Keyframe& keyframe : agent_.keyframes())
      map_.nodes.push_back({.id = {RobotId{0}, index++},
                            .stamp = keyframe.stamp,
                            .representative = keyframe.representative,
                            .T_odom_body = keyframe.T_odom_body,
                            .T_world_body = T_world_reference_ * keyframe.T_odom_body});
    map_.components = 1;
  }
  /// The server's map of nodes [first, last) is in a frame of its own.
  void put_elsewhere(std::size_t first, std::size_t last) {
    const Pose3 T_elsewhere_world{Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ())), {100, 0, 0}};
    for (std::size_t i = first; i < last; ++i) {
      map_.nodes[i].component = map_.components;
      map_.nodes[i].T_world_body = T_elsewhere_world * map_.nodes[i].T_world_body;
    }
    ++map_.components;
  }
  const RobotRecord& evaluate() {
    record_.robots.resize(1);
    evaluate_robots({{&recording_, "spectral", {{"spectral", &agent_}}, replayed_}}, map_, nullptr, {}, record_);
    return record_.robots[0];
  }

  MissionRecording recording_;
  robot::RobotAgent agent_{RobotId{0}, 0, robot::AgentConfig{}};
  server::MapEstimate map_;
  MissionRecord record_;
  std::size_t replayed_ = kSamples;
  const Pose3 T_world_reference_{Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitX())), {5, 6, 7}};
};

TEST_F(EvaluateRobots, AWholeChainIsScoredWhole) {
  const RobotRecord& robot = evaluate();
  EXPECT_EQ(robot.server_estimate.size(), map_.nodes.size());
  EXPECT_LT(*robot.server.rmse_m, 1e-9);
  EXPECT_TRUE(record_.notes.empty());
  EXPECT_DOUBLE_EQ(*robot.onboard.scored_share, 1.0);
  EXPECT_DOUBLE_EQ(*robot.server.scored_share, 1.0);
  EXPECT_DOUBLE_EQ(robot.mapped_share, 1.0);
}

// The first keyframes are a segment of their own: the rest is what counts.
TEST_F(EvaluateRobots, TheLargestSegmentIsScoredAndItsShareReported) {
  put_elsewhere(0, 11);
  const RobotRecord& robot = evaluate();
  EXPECT_EQ(robot.component, 0U);
  EXPECT_EQ(robot.server_estimate.size(), 30U);
  EXPECT_EQ(robot.server_estimate.front().stamp, at(11));
  EXPECT_LT(*robot.server.rmse_m, 1e-9);
  EXPECT_NEAR(*robot.server.scored_share, 29.5 / 40.0, 1e-9);
  EXPECT_NEAR(robot.mapped_share, 29.5 / 40.0, 1e-9);
  EXPECT_TRUE(is_partial(robot.server.scored_share));
  EXPECT_FALSE(is_partial(robot.onboard.scored_share));
  EXPECT_FALSE(is_partial(robot.policies[0].accuracy.scored_share));
  EXPECT_NE(record_.notes.at(0).find("11 of 41 keyframes"), std::string::npos) << record_.notes[0];
}

TEST_F(EvaluateRobots, KeyframesThatNeverCameAreNotScored) {
  map_.nodes.erase(map_.nodes.begin() + 5, map_.nodes.begin() + 15);
  const RobotRecord& robot = evaluate();
  EXPECT_NEAR(*robot.server.scored_share, 0.75, 1e-9);
  EXPECT_DOUBLE_EQ(*robot.onboard.scored_share, 1.0);
}

TEST_F(EvaluateRobots, AReferenceOfHalfTheDistanceScoresHalf) {
  recording_.recording.reference.resize(21);
  const RobotRecord& robot = evaluate();
  for (const auto& share :
       {robot.onboard.scored_share, robot.server.scored_share, robot.policies[0].accuracy.scored_share})
    EXPECT_NEAR(*share, 20.5 / 40.0, 1e-9);
  EXPECT_DOUBLE_EQ(robot.mapped_share, 1.0);
  record_ = {};
  recording_.score_against_reference = false;
  EXPECT_FALSE(evaluate().onboard.scored_share.has_value());
}

TEST_F(EvaluateRobots, PosesOfAnotherComponentAreNotCompared) {
  const std::size_t first = map_.nodes.size() - 10;
  put_elsewhere(first, map_.nodes.size());
  const RobotRecord& robot = evaluate();
  EXPECT_EQ(robot.component, 0U);
  EXPECT_EQ(robot.server_estimate.size(), first);
  EXPECT_LT(*robot.server.rmse_m, 1e-9);
  ASSERT_EQ(robot.policies.size(), 1U);
  EXPECT_LT(*robot.policies[0].agreement_rmse_m, 1e-9);
  ASSERT_EQ(record_.notes.size(), 1U);
  EXPECT_NE(record_.notes[0].find("alpha"), std::string::npos);
  EXPECT_NE(record_.notes[0].find("10 of 41 keyframes"), std::string::npos) << record_.notes[0];
}

TEST_F(EvaluateRobots, OnlyWhatWasReplayedCounts) {
  recording_.recording.drift_origins = {{.from = at(5), .until = at(7)}, {.from = at(30), .until = at(31)}};
  const RobotRecord whole = evaluate();
  EXPECT_DOUBLE_EQ(whole.duration_s, 40.0);
  EXPECT_NEAR(whole.distance_m, 40.0, 0.1);
  EXPECT_EQ(whole.drift_origins.size(), 2U);
  record_ = {};
  replayed_ = 21;  // the mission ended after 20 s
  const RobotRecord half = evaluate();
  EXPECT_DOUBLE_EQ(half.duration_s, 20.0);
  EXPECT_NEAR(half.distance_m, 20.0, 0.05);
  EXPECT_EQ(half.drift_origins.size(), 1U);
  record_ = {};
  replayed_ = 0;  // it ended before the robot started
  const RobotRecord none = evaluate();
  EXPECT_EQ(none.duration_s, 0.0);
  EXPECT_EQ(none.distance_m, 0.0);
  EXPECT_TRUE(none.drift_origins.empty());
}

}  // namespace evaluate_robots_test
}  // namespace tutti::mission
