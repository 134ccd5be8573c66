// SPDX-License-Identifier: BSD-3-Clause
// Two programs on copies of one state folder, and their server.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "support/node/stored_server.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace robot_copy_test {

constexpr RobotId kRobot{0};
constexpr Timestamp kStart{1'700'000'000'000'000'000LL};

/// A robot's program that drives at 1 m/s, in a direction of its own.
struct Program {
  Program(std::uint32_t incarnation, double turn, const storage::MemoryStore::Tables& state = {})
      : store(storage::robot_schema(), state), direction(turn) {
    RobotNodeConfig config;
    config.name = "alpha";
    config.incarnation = incarnation;
    node = RobotNode::open(kRobot, 100, config, store).value();
    take(node->resume({}));
  }
  void take(Step step) {
    ASSERT_TRUE(store.commit(step.writes).has_value());
    for (bus::Envelope& message : step.messages) sent.push_back(std::move(message));
    for (const Event& event : step.events)
      if (const auto* refused = std::get_if<RobotRefused>(&event.what)) refusals.push_back(refused->why);
  }
  void drive(double from_s, double until_s) {
    for (double s = from_s; s < until_s; s += 0.1) {
      const Eigen::Vector3d p{s * std::cos(direction), s * std::sin(direction), 0.0};
      take(node->add(OdometrySample{kStart + s, {Eigen::Quaterniond::Identity(), p}, 1e-4 * Matrix6d::Identity()},
                     Timestamp{} + s));
    }
  }
  storage::MemoryStore store;
  double direction;
  std::unique_ptr<RobotNode> node;
  std::vector<bus::Envelope> sent;
  std::vector<std::string> refusals;
};

class RobotCopy : public testing::Test {
 protected:
  RobotCopy() {
    node_ = ServerNode::open({kRobot}, std::make_shared<test::EvenVerifier>(), {}, 1, store_).value();
    carry_out(node_->resume(now_));
  }
  void carry_out(Step step) {
    ASSERT_TRUE(store_.commit(step.writes).has_value());
    for (const bus::Envelope& message : step.messages)
      if (message.kind == bus::MessageKind::receipt) receipt_ = message;
    for (const Event& event : step.events) refused_ += std::holds_alternative<RobotRefused>(event.what) ? 1 : 0;
  }
  /// The server hears what it has sent and how it stands, and both hear the last receipt, as of a bus.
  void talk(Program& from, std::vector<Program*> all) {
    now_ = now_ + 1.0;
    for (const bus::Envelope& message : std::exchange(from.sent, {})) carry_out(node_->receive(message, now_));
    carry_out(node_->receive(to_server(bus::Endpoint::of(kRobot), from.node->status(now_)), now_));
    if (receipt_)
      for (Program* program : all) program->take(program->node->receive(*receipt_, now_));
  }
  [[nodiscard]] std::size_t submaps(std::uint64_t session) const {
    std::size_t count = 0;
    EXPECT_TRUE(store_.sizes("submaps", [&](std::string_view key, std::size_t) {
      count += submap_of_key(key)->chain.session == session ? 1 : 0;
    }));
    return count;
  }

  storage::MemoryStore store_{storage::map_schema()};
  std::unique_ptr<ServerNode> node_;
  std::optional<bus::Envelope> receipt_;
  Timestamp now_;
  int refused_ = 0;
};

TEST_F(RobotCopy, TheSecondOfTwoLivingProgramsIsRefusedAndBeginsASessionOfItsOwn) {
  Program first(7, 0.0);
  first.drive(0.0, 30.0);
  const auto copied = first.store.tables();
  Program second(8, 1.0, copied);
  talk(first, {&first, &second});
  for (int i = 0; i < 8; ++i) {
    talk(second, {&first, &second});
    talk(first, {&first, &second});
  }
  EXPECT_EQ(first.node->agent().chain().session, 100U);
  EXPECT_FALSE(first.node->conflict());
  EXPECT_TRUE(first.refusals.empty());
  EXPECT_GE(refused_, 1);
  EXPECT_EQ(second.node->agent().chain().session, 100U + 1 + 8);
  ASSERT_FALSE(second.refusals.empty());
  EXPECT_NE(second.refusals[0].find("the state folder of this one was copied"), std::string::npos)
      << second.refusals[0];
  EXPECT_NE(second.node->status(now_).trouble, "");
  first.drive(30.0, 60.0);
  second.drive(30.0, 60.0);
  talk(first, {&first, &second});
  talk(second, {&first, &second});
  EXPECT_GT(submaps(109), 1U);
  EXPECT_EQ(first.node->backlog().size(), 0U);
}

TEST_F(RobotCopy, ARobotThatIsKilledAndGoesOnIsOneRobot) {
  auto robot = std::make_unique<Program>(7, 0.0);
  for (std::uint32_t start = 8; start < 20; ++start) {
    const double begin_s = 20.0 * (start - 8);
    robot->drive(begin_s, begin_s + 20.0);
    for (int i = 0; i < 3; ++i) talk(*robot, {robot.get()});
    robot->take(robot->node->store_all());
    robot = std::make_unique<Program>(start, 0.0, robot->store.tables());
    talk(*robot, {robot.get()});
    EXPECT_FALSE(robot->node->conflict()) << start;
  }
  EXPECT_EQ(robot->node->agent().chain().session, 100U);
  EXPECT_EQ(refused_, 0);
}

// The other one was never heard beside it: only what is in the map shows that there are two.
TEST_F(RobotCopy, ASubmapThatIsInTheMapWithOtherContentIsNoStoredOne) {
  Program first(7, 0.0);
  first.drive(0.0, 15.0);
  Program second(8, 1.0, first.store.tables());
  first.drive(15.0, 60.0);
  second.drive(15.0, 75.0);
  for (int i = 0; i < 3; ++i) talk(first, {&first});
  const std::size_t of_first = submaps(100), waiting = second.node->backlog().size();
  now_ = now_ + 100.0;
  receipt_.reset();
  for (int i = 0; i < 3; ++i) talk(second, {&second});
  EXPECT_EQ(second.node->agent().chain().session, 109U);
  EXPECT_GE(second.node->status(now_).backlog_submaps, of_first - 1);
  EXPECT_LT(second.node->status(now_).backlog_submaps, waiting + 2);
  EXPECT_NE(second.node->status(now_).trouble.find("submaps stay out of the map"), std::string::npos);
  ASSERT_EQ(second.refusals.size(), 1U);
  EXPECT_FALSE(second.node->conflict());  // so that its program goes on
  second.drive(75.0, 120.0);
  talk(second, {&second});
  EXPECT_GT(submaps(109), 2U);
}

}  // namespace robot_copy_test
}  // namespace tutti::node
