// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/fed_robot.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "support/program/full_disk.hpp"
#include "support/program/hosting.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::program {
namespace fed_robot_test {

constexpr RobotId kRobot{1};
const Trajectory kOdometry = robot::test::drifting_odometry(400);

OdometrySample sample(std::size_t i) { return {kOdometry[i].stamp, kOdometry[i].pose, robot::test::kStepCovariance}; }

Scan scan(std::size_t i) {
  PointCloud cloud;
  for (int k = 0; k < 50; ++k) cloud.points.emplace_back(5.0F, static_cast<float>(k), static_cast<float>(i));
  return {kOdometry[i].stamp, std::make_shared<const PointCloud>(std::move(cloud)), {}};
}

class FedRobotTest : public testing::Test {
 protected:
  FedRobotTest() {
    front_ = std::make_unique<FeedFront>(RobotView("alpha").state(open_robot()->node()), FeedFront::Limits{});
    Host::Parts parts;
    parts.store = &disk_;
    parts.open_port = []() -> Result<std::unique_ptr<bus::Port>> { return std::make_unique<test::SentPort>(nullptr); };
    parts.open_node = [this](bus::Port&) -> Result<std::unique_ptr<Hosted>> {
      return std::make_unique<test::Hosting>(open_robot(), *front_, *host_, clock_);
    };
    host_ = std::make_unique<Host>(std::move(parts), clock_, *log_);
  }
  std::unique_ptr<drive::Driver> open_robot() {
    return std::make_unique<drive::Driver>(std::move(node::RobotNode::open(kRobot, 7, {}, disk_).value()));
  }
  void feed(std::size_t from, std::size_t until) {
    for (std::size_t i = from; i < until; ++i) {
      ASSERT_TRUE(front_->add(sample(i)));
      ASSERT_EQ(front_->state().newest->stamp, kOdometry[i].stamp);
      if (i % 5 != 0) continue;
      ASSERT_TRUE(front_->add(scan(i)));
    }
  }
  /// As Host::run() does, `count` times, until everything is taken.
  void turns(int count) {
    for (int i = 0; i < count; ++i, wall_s_ += 0.02) {
      host_->turn();
      host_->wait(0.0);
    }
  }
  [[nodiscard]] const robot::RobotAgent& agent() const {
    return dynamic_cast<test::Hosting*>(host_->hosted())->agent();
  }
  void expect_the_robot_of_all_that_was_fed() {
    robot::RobotAgent alone(kRobot, 7, {});
    for (std::size_t i = 0; i < kOdometry.size(); ++i) {
      ASSERT_TRUE(alone.add(OdometrySample{sample(i).stamp, sample(i).T_odom_body, sample(i).increment_covariance}));
      if (i % 5 != 0 || !alone.wants_scan()) continue;
      ASSERT_TRUE(alone.add(scan(i)));
    }
    EXPECT_EQ(agent().keyframes(), alone.keyframes());
    EXPECT_EQ(agent().newest_sample(), kOdometry.back().stamp);
    EXPECT_EQ(agent().covariance(), alone.covariance());
  }

  double wall_s_ = 0.0;
  Clock clock_{1.0, 0.0, [this] { return wall_s_; }};
  std::unique_ptr<EventLog> log_ = EventLog::on_console("test", Level::error);
  test::FullDisk disk_{storage::robot_schema()};
  std::unique_ptr<FeedFront> front_;
  std::unique_ptr<Host> host_;
};

class FedRobotClock : public FedRobotTest, public testing::WithParamInterface<bool> {};

TEST_F(FedRobotTest, TakesWhatIsFedAndSaysHowFarItIsStored) {
  ASSERT_TRUE(host_->open());
  feed(0, 100);
  turns(1);
  EXPECT_TRUE(front_->is_drained());
  feed(100, 200);
  turns(100);  // the journal is written every half second
  EXPECT_EQ(front_->state().stored, kOdometry[199].stamp);
  EXPECT_EQ(agent().newest_sample(), kOdometry[199].stamp);
  EXPECT_EQ(open_robot()->node().agent().newest_sample(), kOdometry[199].stamp);  // after a kill
  feed(200, kOdometry.size());
  turns(100);
  expect_the_robot_of_all_that_was_fed();
}

TEST(RobotView, CallsTeamMatesAsTheMissionDoesElseAsTheMapDoes) {
  storage::MemoryStore store(storage::robot_schema());
  const auto node = node::RobotNode::open(kRobot, 7, {}, store).value();
  for (std::size_t i = 0; i < 200; ++i) static_cast<void>(node->add(sample(i), {}));
  const auto called = [&](std::uint64_t revision, const std::string& in_map, std::map<RobotId, std::string> names) {
    ProxyGraphMessage message = robot::test::broadcast(node->agent(), revision, robot::test::kWorld);
    message.graph.last_seen.front().name = in_map;
    static_cast<void>(node->receive({bus::Endpoint::server(),
                                     bus::Endpoint::of(kRobot),
                                     bus::MessageKind::proxy_graph,
                                     {},
                                     std::make_shared<const std::string>(wire::encode(message))},
                                    {}));
    return RobotView("alpha", std::move(names)).state(*node).team_mates.at(0).name;
  };
  EXPECT_EQ(called(1, "", {}), "robot 9");  // a server of before
  EXPECT_EQ(called(2, "nine", {}), "nine");
  EXPECT_EQ(called(3, "nine", {{RobotId{9}, "bravo"}}), "bravo");
}

TEST_F(FedRobotTest, AFullDiskCostsTheMapAndNeverThePose) {
  ASSERT_TRUE(host_->open());
  feed(0, 100);
  turns(100);
  disk_.full = true;
  feed(100, 150);
  turns(100);
  EXPECT_EQ(host_->hosted(), nullptr);
  EXPECT_TRUE(host_->tries_again());
  EXPECT_NE(host_->trouble().find("disk full"), std::string::npos) << host_->trouble();
  feed(150, 300);  // each is answered
  wall_s_ += Host::kReopen_s;
  turns(10);  // and it tries again, in vain
  feed(300, 350);
  const FeedState state = front_->state();
  EXPECT_EQ(state.newest->stamp, kOdometry[349].stamp);
  EXPECT_EQ(state.stored, kOdometry[99].stamp);
  EXPECT_GT(state.covariance(0, 0), 0.0);
  disk_.full = false;
  wall_s_ += Host::kReopen_s;
  turns(100);
  EXPECT_EQ(host_->trouble(), "");
  feed(350, kOdometry.size());
  turns(100);
  EXPECT_TRUE(front_->take_refusals().empty());
  EXPECT_EQ(front_->state().stored, kOdometry.back().stamp);
  expect_the_robot_of_all_that_was_fed();
}

// Odometry's clock goes back while the disk is full: what is fed waits, in both sessions.
TEST_P(FedRobotClock, ThatGoesBackIsANewSessionWhateverTheDiskDoes) {
  const auto feed_back = [&](std::size_t from, std::size_t until) {
    std::size_t taken = 0;
    for (std::size_t i = from; i < until; ++i) {
      OdometrySample back = sample(i);
      back.stamp = back.stamp - 3600.0;
      taken += front_->add(back) ? 1 : 0;
    }
    return taken;
  };
  ASSERT_TRUE(host_->open());
  feed(0, 50);
  turns(10);
  disk_.full = GetParam();
  feed(50, 100);
  EXPECT_LT(feed_back(100, 200), 100U);
  turns(10);
  EXPECT_EQ(front_->state().newest->stamp, kOdometry[199].stamp - 3600.0);
  disk_.full = false;
  wall_s_ += Host::kReopen_s;
  turns(100);
  EXPECT_EQ(feed_back(200, 250), 50U);
  turns(100);
  EXPECT_EQ(agent().chain().session, 8U);
  EXPECT_EQ(agent().newest_sample(), kOdometry[249].stamp - 3600.0);
  EXPECT_EQ(front_->state().stored, kOdometry[249].stamp - 3600.0);
  EXPECT_EQ(front_->state().chain, agent().chain());
  const auto again = open_robot();  // after a kill
  EXPECT_EQ(again->node().agent().chain(), agent().chain());
  EXPECT_EQ(again->node().agent().newest_sample(), agent().newest_sample());
  EXPECT_TRUE(again->node().backlog().contains({ChainId(kRobot, 7), 0}));
}

INSTANTIATE_TEST_SUITE_P(OfADisk, FedRobotClock, testing::Bool());

TEST_F(FedRobotTest, AStartOnAFullDiskWaitsForRoom) {
  disk_.full = true;
  EXPECT_FALSE(host_->open());
  EXPECT_TRUE(host_->tries_again());
  feed(0, 200);
  turns(10);
  disk_.full = false;
  wall_s_ += Host::kReopen_s;
  feed(200, kOdometry.size());
  turns(200);
  expect_the_robot_of_all_that_was_fed();
}

TEST_F(FedRobotTest, WhatHasComeIsStoredBeforeItEnds) {
  ASSERT_TRUE(host_->open());
  feed(0, kOdometry.size());
  const std::atomic<bool> stop = true;
  host_->run(stop);
  EXPECT_FALSE(front_->add(OdometrySample{kOdometry.back().stamp + 1.0, {}, Matrix6d::Identity()}));
  EXPECT_EQ(open_robot()->node().agent().newest_sample(), kOdometry.back().stamp);
}

}  // namespace fed_robot_test
}  // namespace tutti::program
