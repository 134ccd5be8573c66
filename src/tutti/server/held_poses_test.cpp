// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/held_poses.hpp"

#include <gtest/gtest.h>

#include "support/server/world.hpp"

namespace tutti::server {
namespace held_poses_test {

/// The map of the first robots, by the true closures of a verifier.
MapEstimate map_of(std::uint32_t robots) {
  SubmapSet submaps;
  for (std::uint32_t robot = 0; robot < robots; ++robot)
    for (Submap& submap : test::make_submaps(RobotId{robot}, {}, Rng(3).fork(robot)))
      submaps.emplace(submap.id, std::make_shared<const Submap>(std::move(submap)));
  const test::TestVerifier verifier(7);
  const MemoryPayloadStore none;
  VerdictSet verdicts;
  for (auto a = submaps.begin(); a != submaps.end(); ++a)
    for (auto b = std::next(a); b != submaps.end(); ++b)
      if (verifier.is_candidate(*a->second, *b->second))
        verdicts.emplace(SubmapPair{a->first, b->first}, *verifier.verify(*a->second, *b->second, none));
  return estimate_map(submaps, verdicts, {});
}

/// Yesterday's map, in a world that is turned and shifted against what is computed anew.
HeldPoses held_of(const MapEstimate& map) {
  const Pose3 T_held_world{Eigen::Quaterniond(Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ())), {100.0, -50.0, 3.0}};
  HeldPoses out;
  for (const MapNode& node : map.nodes) out.emplace(node.id, HeldPose{T_held_world * node.T_world_body});
  return out;
}

TEST(HeldPoses, StayToTheBitWhileOthersAreLaidBesideThem) {
  const HeldPoses held = held_of(map_of(2));
  const MapEstimate map = hold(map_of(3), held, {});
  std::size_t others = 0;
  for (const MapNode& node : map.nodes) {
    if (const auto found = held.find(node.id); found != held.end()) {
      EXPECT_EQ(node.T_world_body, found->second.T_world_body);
      continue;
    }
    ++others;
    const MapNode& near = map.nodes[20];
    const Pose3 truth = test::true_pose(near.id.chain.robot, near.id.index).inverse() *
                        test::true_pose(node.id.chain.robot, node.id.index);
    EXPECT_LT(local(truth, near.T_world_body.inverse() * node.T_world_body).head<3>().norm(), 0.25);
  }
  EXPECT_EQ(others, 91U);
  for (std::size_t i = 0; i < map.nodes.size(); ++i) EXPECT_EQ(map.graph.poses[i], map.nodes[i].T_world_body);
}

TEST(HeldPoses, ThatTheMapLacksChangeNothing) {
  const MapEstimate map = map_of(2);
  const MapEstimate same = hold(map, {{KeyframeId{RobotId{9}, 0}, {}}}, {});
  for (std::size_t i = 0; i < map.nodes.size(); ++i) EXPECT_EQ(same.nodes[i].T_world_body, map.nodes[i].T_world_body);
}

/// Robots 0 and 1 were held apart, each in a world of its own, and robot 2 joins them: the larger one stays.
TEST(HeldPoses, OfFloorsThatWereJoinedTheMainOneStaysAndTheOtherComesToIt) {
  const MapEstimate joined = map_of(3);
  HeldPoses held = held_of(joined);
  std::erase_if(held, [](const auto& pose) { return pose.first.chain.robot == RobotId{2}; });
  const Pose3 T_other{Eigen::Quaterniond(Eigen::AngleAxisd(-2.0, Eigen::Vector3d::UnitZ())), {7.0, 900.0, 0.0}};
  std::size_t left_out = 0;
  for (auto& [id, pose] : held)
    if (id.chain.robot == RobotId{1}) pose = {T_other * pose.T_world_body, 4};
  std::erase_if(held, [&](const auto& pose) { return pose.first.chain.robot == RobotId{1} && left_out++ < 5; });
  const MapEstimate map = hold(joined, held, {});
  const MapNode& first = map.nodes.front();
  for (const MapNode& node : map.nodes) {
    const auto found = held.find(node.id);
    EXPECT_TRUE(found == held.end() || found->second.floor != 0 || found->second.T_world_body == node.T_world_body);
    const Pose3 truth = test::true_pose(first.id.chain.robot, first.id.index).inverse() *
                        test::true_pose(node.id.chain.robot, node.id.index);
    EXPECT_LT(local(truth, first.T_world_body.inverse() * node.T_world_body).head<3>().norm(), 0.6);
  }
}

TEST(HeldPoses, FloorsThatNothingJoinsStayEachInItsWorld) {
  MapEstimate map = map_of(1);
  const HeldPoses held = held_of(map);
  HeldPoses floors = held;
  for (auto& [id, pose] : floors) pose.floor = 3;
  for (const MapNode& node : hold(map, floors, {}).nodes) EXPECT_EQ(node.T_world_body, held.at(node.id).T_world_body);
}

}  // namespace held_poses_test
}  // namespace tutti::server
