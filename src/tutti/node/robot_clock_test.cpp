// SPDX-License-Identifier: BSD-3-Clause
// Odometry whose stamps are wrong, or whose clock begins anew: what a robot's node makes of it.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tutti/node/robot_node.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"

namespace tutti::node {
namespace robot_clock_test {

constexpr Timestamp kStart{1'700'000'000'000'000'000LL};
constexpr double kHour_s = 3600.0;

/// A robot that drives at 1 m/s with odometry at the rate of the parameter, on a store.
class RobotClock : public testing::TestWithParam<double> {
 protected:
  RobotClock() { restart(); }
  void restart() {
    store_ = std::make_unique<storage::MemoryStore>(storage::robot_schema(),
                                                    store_ ? store_->tables() : storage::MemoryStore::Tables{});
    node_ = RobotNode::open(RobotId{1}, 100, {}, *store_).value();
    done(node_->resume(now_));
  }
  void done(const Step& step) {
    ASSERT_TRUE(store_->commit(step.writes).has_value());
    for (const Event& event : step.events) {
      refused_ += std::holds_alternative<SampleRefused>(event.what) ? 1 : 0;
      if (const auto* begun = std::get_if<SessionBegun>(&event.what)) begun_.push_back(*begun);
    }
  }
  void add(Timestamp stamp) {
    const Pose3 T_odom_body{Eigen::Quaterniond::Identity(), {driven_s_, 0.0, 0.0}};
    done(node_->add(OdometrySample{stamp, T_odom_body, 1e-6 * Matrix6d::Identity()}, now_));
  }
  /// By a clock that is this far off.
  void drive(double for_s, double clock_s = 0.0) {
    for (const double end_s = driven_s_ + for_s; driven_s_ < end_s - 1e-9;) {
      driven_s_ += 1 / GetParam();
      now_ = Timestamp{} + driven_s_;
      add(kStart + (driven_s_ + clock_s));
    }
  }
  std::string state() const { return wire::encode(node_->agent().state()); }

  std::unique_ptr<storage::MemoryStore> store_;
  std::unique_ptr<RobotNode> node_;
  double driven_s_ = 0.0;
  Timestamp now_;
  int refused_ = 0;
  std::vector<SessionBegun> begun_;
};

INSTANTIATE_TEST_SUITE_P(AtRates, RobotClock, testing::Values(1.0, 200.0));

TEST_P(RobotClock, OneStampInTheFutureCostsNothing) {
  drive(40.0);
  const std::string undisturbed = state();
  store_.reset();
  driven_s_ = 0.0;
  restart();
  drive(10.0);
  add(kStart + kHour_s);
  add(kLastTimestamp);
  EXPECT_EQ(refused_, 2);
  EXPECT_TRUE(node_->status(now_).trouble.empty());
  drive(10.0);
  add(kStart + 2 * kHour_s);
  done(node_->store_all());
  restart();
  drive(20.0);
  EXPECT_EQ(refused_, 3);
  EXPECT_EQ(state(), undisturbed);
  EXPECT_TRUE(begun_.empty());
}

TEST_P(RobotClock, ABreakIsGoneOnAfterWithItsFirstSample) {
  drive(10.0);
  const double before_s = driven_s_;
  drive(5.0, kHour_s);
  EXPECT_EQ(refused_, 1);  // it waits, and learns so
  EXPECT_EQ(node_->agent().newest_sample(), kStart + (driven_s_ + kHour_s));
  EXPECT_EQ(node_->agent().chain().session, 100U);
  EXPECT_TRUE(node_->agent().keyframe_before(kStart + (before_s + kHour_s + 1.5 / GetParam())).value() >
              kStart + kHour_s);
}

TEST_P(RobotClock, AClockThatGoesBackIsASessionOfItsOwn) {
  for (const double back_s : {-kHour_s, -1.7e9, -30.0}) {
    store_.reset();
    begun_.clear();
    driven_s_ = 0.0;
    restart();
    drive(45.0);
    const std::size_t submaps = node_->backlog().size();
    ASSERT_GT(submaps, 2U);
    drive(GetParam() < 10.0 ? 3.0 : 2.0, back_s);  // not yet
    EXPECT_TRUE(begun_.empty());
    EXPECT_NE(node_->status(now_).trouble.find("odometry samples are refused"), std::string::npos);
    drive(2.0, back_s);
    ASSERT_EQ(begun_.size(), 1U);
    EXPECT_EQ(begun_[0].session, 101U);
    EXPECT_NE(begun_[0].why.find("went back by"), std::string::npos);
    EXPECT_NE(node_->status(now_).trouble.find("session 101 has begun"), std::string::npos);
    EXPECT_EQ(node_->status(now_).session, 101U);
    EXPECT_EQ(node_->backlog().size(), submaps + 1);  // the last one of the old session is ended
    EXPECT_EQ(node_->agent().newest_sample(), kStart + (driven_s_ + back_s));
    drive(20.0, back_s);
    ASSERT_EQ(node_->alerts().size(), 1U);
    EXPECT_EQ(node_->alerts().front().since, node_->agent().keyframes().front().stamp);
    if (GetParam() < 10.0) {
      drive(RobotNodeConfig().alert_s, back_s);
      EXPECT_TRUE(node_->alerts().empty());
    }
    done(node_->store_all());
    const std::string before = state();
    begun_.clear();
    restart();
    EXPECT_EQ(state(), before);
    drive(20.0, back_s);
    EXPECT_TRUE(begun_.empty());
    EXPECT_EQ(node_->agent().chain().session, 101U);
    EXPECT_TRUE(node_->backlog().contains({ChainId(RobotId{1}, 101), 1}));
  }
}

// A kill may come right after the new session began, and right before.
TEST_P(RobotClock, AKillLeavesTheOldSessionOrTheNewOne) {
  drive(30.0);
  done(node_->store_all());
  const auto stored = store_->tables();
  drive(4.0, -kHour_s);
  ASSERT_EQ(begun_.size(), 1U);
  restart();
  EXPECT_EQ(node_->agent().chain().session, 101U);
  store_ = std::make_unique<storage::MemoryStore>(storage::robot_schema(), stored);
  restart();
  EXPECT_EQ(node_->agent().chain().session, 100U);
  drive(4.0, -kHour_s);
  EXPECT_EQ(node_->agent().chain().session, 101U);
}

}  // namespace robot_clock_test
}  // namespace tutti::node
