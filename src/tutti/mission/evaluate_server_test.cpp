// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <deque>

#include "tutti/geometry/so3.hpp"
#include "tutti/mission/evaluate.hpp"

namespace tutti::mission {
namespace evaluate_server_test {

/// No submap is compared with any other.
class NoClosures final : public server::ClosureVerifier {
 public:
  [[nodiscard]] MethodId id() const override { return {"none", 1, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap&, const Submap&) const override { return false; }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap&, const Submap&,
                                              const server::PayloadStore&) const override {
    return fail(ErrorCode::invalid, "not asked for");
  }
};

/// Robots with perfect odometry on a line, a metre and a keyframe a second, which the server hears through submaps of
/// 10 s.
class EvaluateServer : public ::testing::Test {
 protected:
  void add(int seconds, std::set<std::uint32_t> lost = {}) {
    const RobotId id{static_cast<std::uint32_t>(runs_.size())};
    Run& run = runs_.emplace_back(id);
    run.recording.recording.robot = id;
    for (int k = 0; k <= seconds; ++k) {
      const StampedPose sample{Timestamp{1'000'000'000'000} + 1.0 * k,
                               {Eigen::Quaterniond::Identity(), {1.0 * k, 0, 0}}};
      run.recording.recording.odometry.push_back(sample);
      run.recording.recording.reference.push_back(sample);
      ASSERT_TRUE(run.agent.add(OdometrySample{sample.stamp, sample.pose, 1e-4 * Matrix6d::Identity()}));
    }
    run.agent.finish();
    for (const SubmapMessage& message : run.agent.take_outgoing())
      if (!lost.contains(message.submap.id.index)) messages_.push_back(message);
  }
  const MissionRecord& evaluate() {
    std::set<RobotId> ids;
    std::vector<RobotOutcome> outcomes;
    for (const Run& run : runs_) {
      ids.insert(run.recording.recording.robot);
      outcomes.push_back(
          {&run.recording, "adaptive", {{"adaptive", &run.agent}}, run.recording.recording.odometry.size()});
    }
    server::MapServer server(ids, std::make_shared<const NoClosures>(), std::make_shared<server::MemoryPayloadStore>(),
                             server::ServerConfig{}, 1);
    for (const SubmapMessage& message : messages_) EXPECT_TRUE(server.receive(message));
    server.optimise();
    record_.robots.resize(runs_.size());
    evaluate_robots(outcomes, server.map(), nullptr, {}, record_);
    evaluate_server(outcomes, server, {}, {}, record_);
    return record_;
  }

 private:
  struct Run {
    explicit Run(RobotId id) : agent(id, 1, robot::AgentConfig{}) {}
    MissionRecording recording;
    robot::RobotAgent agent;
  };
  std::deque<Run> runs_;
  std::vector<SubmapMessage> messages_;
  MissionRecord record_;
};

TEST(CheckClosures, CountsAsWrongWhatTheMissionSays) {
  MissionRecording robot;
  server::MapEstimate map;
  const Pose3 T_true_claimed{so3_exp({0.0, 0.0, 3.0 * kRadPerDeg}), {0.3, 0.0, 0.0}};
  for (std::uint32_t k = 0; k < 20; ++k) {
    const StampedPose pose{Timestamp{1'000'000'000'000} + 1.0 * k, {Eigen::Quaterniond::Identity(), {1.0 * k, 0, 0}}};
    robot.recording.reference.push_back(pose);
    map.nodes.push_back({.id = {RobotId{0}, k}, .stamp = pose.stamp});
  }
  const Pose3 T_0_15{Eigen::Quaterniond::Identity(), {15.0, 0.0, 0.0}};
  map.closures = {{.closure = {{RobotId{0}, 0}, {RobotId{0}, 15}, {T_0_15 * T_true_claimed, {}}}, .accepted = true}};
  const auto wrong = [&](const ClosureCheckConfig& config) {
    const auto check = check_closures(map, {&robot}, {}, config);
    EXPECT_EQ(check->checked, 1U);
    EXPECT_NEAR(check->max_error_deg, 3.0, 1e-9);
    EXPECT_EQ(check->wrong_deg, config.wrong_deg);
    return check->wrong;
  };
  EXPECT_EQ(wrong({}), 1U);
  EXPECT_EQ(wrong({.wrong_deg = 5.0}), 0U);
  EXPECT_EQ(wrong({.wrong_m = 0.2, .wrong_deg = 5.0}), 1U);
}

TEST_F(EvaluateServer, AMapOfEverythingIsScoredWhole) {
  add(60);
  const MissionRecord& record = evaluate();
  EXPECT_LT(*record.server.joint.rmse_m, 1e-6);
  EXPECT_NEAR(*record.server.joint.scored_share, 1.0, 1e-9);
  EXPECT_NEAR(record.robots[0].mapped_share, 1.0, 1e-9);
}

TEST_F(EvaluateServer, TheJointFigureHasTheShareOfAllDistancesItIsScoredOn) {
  add(30);
  add(60);
  const MissionRecord& record = evaluate();
  EXPECT_EQ(record.server.components, 2U);
  EXPECT_EQ(record.server.largest_component, record.robots[1].component);
  EXPECT_NEAR(*record.server.joint.scored_share, 60.0 / 90.0, 1e-9);
  EXPECT_TRUE(record.transforms.empty());
}

TEST_F(EvaluateServer, AGapNearTheStartLeavesTheLargerSegment) {
  add(60, {1});
  const MissionRecord& record = evaluate();
  EXPECT_EQ(record.server.components, 2U);
  EXPECT_EQ(record.robots[0].component, 1U);
  EXPECT_EQ(record.server.largest_component, 1U);
  EXPECT_NEAR(*record.robots[0].server.scored_share, 40.5 / 60.0, 1e-9);
  EXPECT_NEAR(*record.server.joint.scored_share, 40.5 / 60.0, 1e-9);
}

}  // namespace evaluate_server_test
}  // namespace tutti::mission
