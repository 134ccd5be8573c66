// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/robot_view.hpp"

#include <gtest/gtest.h>

#include "support/localise/tunnel.hpp"
#include "support/program/feed/node_target.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti::program {
namespace robot_view_test {

/// As localise::test::feed() wants it; scans are wanted where the live feed says so, which is all that a client knows.
struct Fed {
  test::NodeTarget& robot;
  Status add(const Input& input) { return robot.add(input); }
  [[nodiscard]] bool wants_scan(Timestamp) const { return robot.state().wants_scan; }
};

TEST(RobotView, TellsAClientWhereTheRobotIsInItsMapAndAsksForTheScansThatThisTakes) {
  const auto world = localise::test::make_world(3);
  const Recording& recording = world.robots[2];
  node::RobotNodeConfig config;
  config.agent.submap.has_scans = true;
  config.localise = std::make_shared<const localise::Localiser::Setup>(localise::Localiser::Setup{
      .map = world.map, .make_verifier = localise::test::verifier, .submap = config.agent.submap});
  test::NodeTarget robot(RobotId{7}, config);
  Fed fed{robot};
  std::size_t localised = 0, with_pose = 0;
  localise::test::feed(recording, recording.odometry, 0, recording.odometry.size(), fed, [&] {
    const FeedState state = robot.state();
    localised += robot.node().localiser()->state() == localise::State::localised ? 1 : 0;
    with_pose += state.T_world_body.has_value() ? 1 : 0;
    EXPECT_EQ(state.T_world_body.has_value(), state.T_map_world.has_value());
    if (!state.T_world_body) return;
    const Pose3 truth = pose_at(recording.reference, state.located).value();
    EXPECT_LT((state.T_world_body->T_a_b.translation - truth.translation).norm(), 0.3);
    const Pose3 by_frames = state.T_map_world->inverse() * state.T_map_odom * state.newest->pose;  // world -> map -> ..
    EXPECT_LT((by_frames.translation - truth.translation).norm(), 0.3);
    EXPECT_EQ(state.component, 0U);
  });
  EXPECT_EQ(with_pose, localised);
  EXPECT_GT(localised, recording.odometry.size() / 2);
}

}  // namespace robot_view_test
}  // namespace tutti::program
