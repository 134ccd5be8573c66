// SPDX-License-Identifier: BSD-3-Clause
// How an agent handles odometry that jumps, begins anew or repeats itself.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "support/robot/drifting_robot.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::robot {
namespace odometry_jump_test {

using namespace test;  // NOLINT: the robot and server of these tests

const Matrix6d kCovariance = 1e-6 * Matrix6d::Identity();

Pose3 ahead(double x_m) { return {Eigen::Quaterniond::Identity(), {x_m, 0.0, 0.0}}; }

struct Fed {
  std::vector<OdometryJump> jumps;
  std::vector<SubmapMessage> submaps;
  std::vector<Error> refused;
};

/// A minute at 1 m/s, fed from where the front end is off by so much at each time.
template <class Offset>
Fed feed(RobotAgent& agent, double rate_hz, bool with_scans, const Offset& offset_m) {
  Fed out;
  const auto cloud = std::make_shared<const PointCloud>(PointCloud{{{5.0F, 3.0F, 1.0F}}});
  for (int i = 0; i < 60.0 * rate_hz; ++i) {
    const double t = i / rate_hz;
    const Pose3 fed = ahead(t + offset_m(t));
    if (auto ok = agent.add(OdometrySample{at(0) + t, fed, kCovariance}); !ok) out.refused.push_back(ok.error());
    EXPECT_LT(local(agent.T_odom_fed() * fed, agent.T_odom_body()).norm(), 1e-9) << t;
    const bool has_scan = with_scans && i % std::max(1, static_cast<int>(0.1 * rate_hz)) == 0;
    if (has_scan && !agent.add(Scan{at(0) + t, cloud, {}})) ADD_FAILURE() << t;
    for (const OdometryJump& jump : agent.take_odometry_jumps()) out.jumps.push_back(jump);
    for (SubmapMessage& submap : agent.take_outgoing()) out.submaps.push_back(std::move(submap));
  }
  agent.finish();
  for (SubmapMessage& submap : agent.take_outgoing()) out.submaps.push_back(std::move(submap));
  return out;
}

double sigma_m(const RobotAgent& agent) { return std::sqrt(agent.covariance()(0, 0)); }

struct Case {
  const char* what;
  double at_s, offset_m, jump_m;
};

/// The front end begins anew at the origin; it is elsewhere by 500 m, by 5 m.
class Jumps : public testing::TestWithParam<std::tuple<double, bool, Case>> {};

TEST_P(Jumps, AreReportedAndTheRobotGoesOnFromWhereItIs) {
  const auto& [rate_hz, with_scans, jump] = GetParam();
  const auto& [what, at_s, offset_m, jump_m] = jump;
  RobotAgent agent(RobotId{1}, 1, {}), undisturbed(RobotId{1}, 1, {});
  const auto off = [&, at = at_s, by = offset_m](double t) { return t < at ? 0.0 : by; };
  const Fed fed = feed(agent, rate_hz, with_scans, off),
            plain = feed(undisturbed, rate_hz, with_scans, [](double) { return 0.0; });
  EXPECT_TRUE(plain.jumps.empty());
  EXPECT_TRUE(fed.refused.empty());
  ASSERT_EQ(fed.jumps.size(), 1U);
  EXPECT_NEAR(fed.jumps[0].translation_m, jump_m, 0.3);
  EXPECT_NEAR(fed.jumps[0].to - at(0), at_s, 1e-9);
  // The motion of one step is not known: the robot is where it would be but for that step, and its covariance includes
  // it.
  EXPECT_LT((agent.T_odom_body().translation - undisturbed.T_odom_body().translation).norm(), 1.01 / rate_hz);
  EXPECT_LT(sigma_m(undisturbed), 1.0);
  EXPECT_GT(sigma_m(agent), 9.0);
  // No submap has scans of before and after; one without any leads across, and only it is unsure.
  int across = 0;
  for (const SubmapMessage& message : fed.submaps) {
    const Submap& submap = message.submap;
    const bool is_across =
        submap.keyframes.front().stamp < fed.jumps[0].to && submap.keyframes.back().stamp >= fed.jumps[0].to;
    if (is_across) {
      ++across;
      EXPECT_EQ(submap.keyframes.size(), 2U);
      EXPECT_EQ(submap.keyframes.front().stamp, fed.jumps[0].from);
      EXPECT_EQ(submap.keyframes.back().stamp, fed.jumps[0].to);
      EXPECT_EQ(submap.cloud, nullptr);
    } else if (with_scans) {
      EXPECT_NE(submap.cloud, nullptr);
    }
    for (const RelativePose& step : submap.odometry) EXPECT_EQ(step.covariance(0, 0) > 1.0, is_across);
  }
  EXPECT_EQ(across, 1);
  for (std::size_t k = 1; k < agent.keyframes().size(); ++k)
    EXPECT_LT(local(agent.keyframes()[k - 1].T_odom_body, agent.keyframes()[k].T_odom_body).norm(), 1.1);
}

INSTANTIATE_TEST_SUITE_P(All, Jumps,
                         testing::Combine(testing::Values(10.0, 200.0), testing::Bool(),
                                          testing::Values(Case{"anew", 30.0, -30.0, 30.0},
                                                          Case{"far", 30.1, 500.0, 500.0},
                                                          Case{"near", 31.0, -5.0, 5.0})));

TEST(OdometryJumps, AnOutlierIsTwo) {
  RobotAgent agent(RobotId{1}, 1, {});
  const Fed fed = feed(agent, 10.0, true, [](double t) { return t > 29.95 && t < 30.05 ? 500.0 : 0.0; });
  EXPECT_EQ(fed.jumps.size(), 2U);
  EXPECT_NEAR(agent.T_odom_body().translation.x(), 59.7, 0.01);
}

TEST(OdometryJumps, AStampTwiceOrOfBeforeIsRefusedAndTheRobotGoesOn) {
  RobotAgent agent(RobotId{1}, 1, {});
  const auto add = [&](double t, double x_m) { return agent.add(OdometrySample{at(0) + t, ahead(x_m), kCovariance}); };
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(add(0.1 * i, 0.1 * i));
  const AgentHead before = agent.head();
  for (const double t : {9.9, 9.8, 0.0, -1.7e9}) {
    const Status refused = add(t, 400.0);
    ASSERT_FALSE(refused.has_value());
    EXPECT_NE(refused.error().message.find("does not follow"), std::string::npos) << refused.error().message;
  }
  EXPECT_EQ(agent.head().watch, before.watch);
  EXPECT_EQ(agent.T_odom_body(), before.T_odom_body);
  ASSERT_TRUE(add(10.0, 10.0));
  EXPECT_TRUE(agent.take_odometry_jumps().empty());
  EXPECT_EQ(agent.T_odom_body(), ahead(10.0));
}

/// The server's map takes the uncertainty away, and the robot's own answers go on from there.
TEST(OdometryJumps, TheMapSaysWhereTheRobotIsAfterwards) {
  AgentConfig config;
  RobotAgent agent(RobotId{1}, 1, config);
  const Trajectory odometry = drifting_odometry(240);
  const Pose3 anew = odometry[120].pose.inverse();
  int jumps = 0;
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    const Pose3 fed = i < 120 ? odometry[i].pose : anew * odometry[i].pose;
    ASSERT_TRUE(agent.add(OdometrySample{odometry[i].stamp, fed, kStepCovariance}));
    jumps += static_cast<int>(agent.take_odometry_jumps().size());
  }
  EXPECT_EQ(jumps, 1);
  EXPECT_GT(sigma_m(agent), 9.0);
  for (std::uint64_t revision = 1; revision <= 5; ++revision) agent.receive(broadcast(agent, revision, kWorld));
  EXPECT_LT(sigma_m(agent), 1.0);
  const Trajectory corrected = agent.corrected();
  double worst = 0.0;
  const Pose3 T_map_true = corrected.front().pose * true_pose(0).inverse();
  for (const StampedPose& pose : corrected)
    worst = std::max(worst,
                     (pose.pose.translation - (T_map_true * true_pose((pose.stamp - at(0)) / 0.5)).translation).norm());
  EXPECT_LT(worst, 0.5);
}

}  // namespace odometry_jump_test
}  // namespace tutti::robot
