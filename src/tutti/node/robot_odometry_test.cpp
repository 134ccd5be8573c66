// SPDX-License-Identifier: BSD-3-Clause
// Odometry that jumps, or is refused: what a robot's node reports of it, and that a kill changes nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tutti/base/plain_text.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"

namespace tutti::node {
namespace robot_odometry_test {

constexpr Timestamp kStart{1'700'000'000'000'000'000LL};

/// A robot on a store, whose steps are committed.
class RobotOdometry : public testing::Test {
 protected:
  RobotOdometry() { restart(); }
  void restart() {
    store_ = std::make_unique<storage::MemoryStore>(storage::robot_schema(),
                                                    store_ ? store_->tables() : storage::MemoryStore::Tables{});
    node_ = RobotNode::open(RobotId{1}, 100, config_, *store_).value();
    resumed_ = done(node_->resume(now_));
  }
  Step done(Step step) {
    EXPECT_TRUE(store_->commit(step.writes).has_value());
    return step;
  }

  RobotNodeConfig config_;
  std::unique_ptr<storage::MemoryStore> store_;
  std::unique_ptr<RobotNode> node_;
  Step resumed_;
  Timestamp now_;
};

// A jump is reported once, with its size and stamp, and a kill right before or after it changes nothing.
TEST_F(RobotOdometry, OdometryThatJumpsIsReportedAndAKillChangesNothing) {
  const auto pose = [](int i) {
    return Pose3{Eigen::Quaterniond::Identity(),
                 {0.1 * i + (i < 150 ? 0.0 : -15.0) + (i < 253 ? 0.0 : 500.0), 0.0, 0.0}};
  };
  std::vector<OdometryJumped> reported;
  const auto live = [&](int from, int to) {
    for (int i = from; i < to; ++i) {
      now_ = Timestamp{} + 0.1 * i;
      const Step step = done(node_->add(OdometrySample{kStart + 0.1 * i, pose(i), 1e-6 * Matrix6d::Identity()}, now_));
      for (const Event& event : step.events)
        if (const auto* jumped = std::get_if<OdometryJumped>(&event.what)) reported.push_back(*jumped);
    }
  };
  EXPECT_EQ(node_->status(now_).trouble, "");
  live(0, 400);
  ASSERT_EQ(reported.size(), 2U);
  EXPECT_EQ(reported[0].jump.to, kStart + 15.0);
  EXPECT_NEAR(reported[0].jump.translation_m, 14.9, 1e-9);
  EXPECT_NEAR(reported[1].jump.translation_m, 500.1, 1e-9);
  ASSERT_EQ(node_->alerts().size(), 1U);
  const RobotAlert told = node_->alerts().front();
  EXPECT_TRUE(told.text.starts_with(to_string(reported[1].jump) + " (2 so far)")) << told.text;
  EXPECT_EQ(std::pair(told.from, told.until), std::pair(reported[1].jump.from, reported[1].jump.to));
  EXPECT_EQ(node_->status(now_).trouble, plain_text(told.text));
  const std::string whole = wire::encode(node_->agent().state());
  const Pose3 T_odom_fed = node_->agent().T_odom_fed();

  for (const int kill : {149, 150, 151, 153, 155, 200, 252, 253, 254, 399}) {
    store_.reset();
    now_ = {};
    restart();
    live(0, kill);
    reported.clear();
    restart();  // without what waited to be written
    EXPECT_TRUE(resumed_.events.empty());
    const auto newest = node_->agent().newest_sample().value();
    live(static_cast<int>(std::lround((newest - kStart) / 0.1)) + 1, 400);
    EXPECT_EQ(wire::encode(node_->agent().state()), whole) << kill;
    EXPECT_EQ(node_->agent().T_odom_fed(), T_odom_fed) << kill;
    EXPECT_LE(reported.size(), 2U) << kill;
  }
  config_.alert_s = 10.0;
  store_.reset();
  restart();
  live(0, 300);
  EXPECT_EQ(node_->alerts().size(), 1U);
  live(300, 400);
  EXPECT_TRUE(node_->alerts().empty());
}

TEST_F(RobotOdometry, TheStatusSaysTheWorstOfItsAlerts) {
  const auto add = [&](int i) {
    const Pose3 T_odom_body{Eigen::Quaterniond::Identity(), {0.1 * i + (i < 250 ? 0.0 : 500.0), 0.0, 0.0}};
    done(node_->add(OdometrySample{kStart + 0.1 * i, T_odom_body, 1e-6 * Matrix6d::Identity()}, now_));
  };
  for (int i = 0; i < 100; ++i) add(i);
  done(node_->begin_session("its clock went back", now_));
  for (int i = 100; i < 400; ++i) add(i);
  const std::vector<RobotAlert> alerts = node_->alerts();
  ASSERT_EQ(alerts.size(), 2U);
  EXPECT_NE(alerts[0].text.find("no body moves so"), std::string::npos) << alerts[0].text;
  EXPECT_NE(alerts[1].text.find("its clock went back"), std::string::npos) << alerts[1].text;
  EXPECT_EQ(node_->status(now_).trouble, plain_text(alerts[1].text));
}

TEST_F(RobotOdometry, SamplesThatAreRefusedInARowAreItsTrouble) {
  const auto add = [&](double t) {
    return done(node_->add(OdometrySample{kStart + t, {}, 1e-6 * Matrix6d::Identity()}, now_));
  };
  for (int i = 0; i < 10; ++i) add(0.1 * i);
  const auto refused = [&](std::uint64_t samples) {
    for (std::uint64_t i = 0; i < samples; ++i) {
      const Step step = add(-1e9);
      EXPECT_TRUE(std::holds_alternative<SampleRefused>(step.events.at(0).what));
    }
  };
  refused(OdometryGate::kMostRefused - 1);
  EXPECT_EQ(node_->status(now_).trouble, "");
  refused(1);
  const std::string trouble = node_->status(now_).trouble;
  EXPECT_NE(trouble.find("odometry samples are refused"), std::string::npos) << trouble;
  EXPECT_NE(trouble.find("does not follow"), std::string::npos) << trouble;
  add(1.0);
  EXPECT_EQ(node_->status(now_).trouble, "");
}

}  // namespace robot_odometry_test
}  // namespace tutti::node
