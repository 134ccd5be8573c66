// SPDX-License-Identifier: BSD-3-Clause
// A robot's node in a map that does not move.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <variant>

#include "support/localise/tunnel.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::node {
namespace robot_place_test {

constexpr RobotId kRobot{7};

/// A node on a store; its steps are committed.
struct Robot {
  explicit Robot(std::shared_ptr<const localise::KnownMap> map, storage::MemoryStore::Tables stored = {})
      : store(storage::robot_schema(), std::move(stored)) {
    RobotNodeConfig config;
    config.agent.submap.has_scans = true;
    if (map)
      config.localise = std::make_shared<const localise::Localiser::Setup>(localise::Localiser::Setup{
          .map = std::move(map), .make_verifier = localise::test::verifier, .submap = config.agent.submap});
    node = RobotNode::open(kRobot, 1, config, store).value();
    done(node->resume({}));
  }
  /// As test::feed() wants it; what is refused is an error.
  Status add(const Input& input) {
    now = std::max(now, stamp_of(input));
    return done(node->add(input, now));
  }
  [[nodiscard]] bool wants_scan(Timestamp stamp) const { return node->wants_scan(stamp); }
  Status done(const Step& step) {
    EXPECT_TRUE(store.commit(step.writes).has_value());
    for (const Event& event : step.events) {
      if (const auto* refused = std::get_if<SampleRefused>(&event.what))
        return fail(ErrorCode::invalid, "{}", refused->why);
      if (std::holds_alternative<RobotUpdated>(event.what)) ++updates;
    }
    return {};
  }
  storage::MemoryStore store;
  std::unique_ptr<RobotNode> node;
  Timestamp now;
  std::size_t updates = 0;
};

/// The root mean square of a trajectory's errors while it is seen from its first pose.
double error_m(const Trajectory& trajectory, const Trajectory& truth) {
  const Pose3 T_truth_map = pose_at(truth, trajectory.front().stamp).value() * trajectory.front().pose.inverse();
  double squares = 0.0;
  for (const auto& [stamp, pose] : trajectory)
    squares += ((T_truth_map * pose).translation - pose_at(truth, stamp)->translation).squaredNorm();
  return std::sqrt(squares / static_cast<double>(trajectory.size()));
}

TEST(RobotPlace, WithoutAServerTheMapThatItIsLocalisedInCorrectsItsTrajectory) {
  const auto world = localise::test::make_world(3);
  const Recording& recording = world.robots[2];
  Robot with(world.map), without(nullptr);
  for (Robot* robot : {&with, &without})
    localise::test::feed(recording, recording.odometry, 0, recording.odometry.size(), *robot);
  const Trajectory &corrected = with.node->agent().corrected(), raw = without.node->agent().corrected();
  EXPECT_EQ(without.updates, 0U);
  EXPECT_GT(with.updates, 3U);
  EXPECT_LT(with.updates, 20U);
  EXPECT_GT(error_m(raw, recording.reference), 0.5);
  EXPECT_LT(error_m(corrected, recording.reference), 0.25 * error_m(raw, recording.reference));
  EXPECT_GT(with.node->agent().ledger().size(), 0U);

  // What it has heard is in its store, as what a server sends is.
  RobotNodeConfig config;
  config.agent.submap.has_scans = true;
  (void)with.done(with.node->store_all());
  const auto again = RobotNode::open(kRobot, 2, config, with.store).value();
  EXPECT_EQ(again->agent().ledger().size(), with.node->agent().ledger().size());
}

TEST(RobotPlace, AfterAStartItsLastPlaceIsTriedFirstAndScansConfirmItInASecond) {
  const auto world = localise::test::make_world(3);
  const Recording& recording = world.robots[2];
  Robot robot(world.map);
  std::size_t k = 0;
  for (; k < 250; ++k) localise::test::feed(recording, recording.odometry, k, k + 1, robot);
  ASSERT_EQ(robot.node->localiser()->state(), localise::State::localised);
  (void)robot.done(robot.node->store_all());
  const auto restart = [&](const std::shared_ptr<const localise::KnownMap>& map) {
    Robot again(map, robot.store.tables());
    localise::test::feed(recording, recording.odometry, k, k + 10, again);
    return again.node->localiser()->state();
  };
  EXPECT_EQ(restart(world.map), localise::State::localised);
  auto other = std::make_shared<localise::KnownMap>(*world.map);
  other->id = "another";
  EXPECT_EQ(restart(other), localise::State::searching);
}

TEST(RobotPlace, AStartPoseForARobotWithoutAMapIsRefusedWithTheWayOn) {
  Robot robot(nullptr);
  const Status refused = robot.add(StartPose{});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().message,
            "a start pose, and this robot does not localise in a map: start it with --map FILE --localise");
}

}  // namespace robot_place_test
}  // namespace tutti::node
