// SPDX-License-Identifier: BSD-3-Clause
// How far links of little support move a robot.
#include <gtest/gtest.h>

#include "tutti/geometry/so3.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/robot/testing/drifting_robot.hpp"

namespace tutti::robot {
namespace {

using namespace test;  // NOLINT: the robot and server of these tests

/// Raw odometry without drift; a server whose map turns by `yaw_rad` at node `at_node`, as closures would have it. All
/// covariances are odometry's.
ProxyGraphMessage bent_broadcast(const RobotAgent& agent, double yaw_rad, std::size_t at_node, std::uint32_t support) {
  ProxyGraphMessage message = broadcast(agent, 1, kWorld);
  auto& nodes = message.graph.nodes;
  nodes.pop_back();  // the other robot
  const Pose3 pivot = nodes[at_node].T_world_body;
  const Pose3 turn = pivot * Pose3{so3_exp(Eigen::Vector3d(0, 0, yaw_rad)), Eigen::Vector3d::Zero()} * pivot.inverse();
  for (std::size_t k = 1; k < nodes.size(); ++k) {
    nodes[k].covariance = 2.0 * kStepCovariance;  // two samples a node
    nodes[k].support = support;
    if (k > at_node) nodes[k].T_world_body = turn * nodes[k].T_world_body;
  }
  return message;
}

/// The share of what the server asks for by which the robot's last pose moves, seen from its first.
double obeyed(const std::string& policy, double yaw_rad, std::uint32_t support) {
  AgentConfig config;
  config.policy.name = policy;
  RobotAgent agent(RobotId{1}, 1, config, Rng(1));
  Trajectory odometry;
  for (int i = 0; i < 120; ++i) odometry.push_back({at(i), true_pose(0).inverse() * true_pose(i)});
  feed(agent, odometry);
  const ProxyGraphMessage message = bent_broadcast(agent, yaw_rad, 30, support);
  const auto& nodes = message.graph.nodes;
  const Pose3 asked = nodes.front().T_world_body.inverse() * nodes.back().T_world_body;
  std::size_t last = 0;
  for (std::size_t k = 0; k < agent.keyframes().size(); ++k)
    if (agent.keyframes()[k].representative) last = k;
  const Pose3 before = agent.corrected()[last].pose;
  const auto summary = agent.receive(message, 1);
  EXPECT_GT(summary.constraints, 0U);
  const Eigen::Vector3d wanted = asked.translation - before.translation;
  return (agent.corrected()[last].pose.translation - before.translation).dot(wanted) / wanted.squaredNorm();
}

// "Who is wrong?": odometry's sigma over the run is 0.11 rad, so one link over it is weighed, 1 / (1 + doubt^2) at
// most.
TEST(Agent, ALoneClosureMovesItLittleAndThreeMoveItFully) {
  for (const char* policy : {"uniform", "adaptive"}) EXPECT_NEAR(obeyed(policy, 0.3, 3), 1.0, 0.03) << policy;
  EXPECT_LT(obeyed("uniform", 0.3, 1), 0.2);
  EXPECT_GT(obeyed("uniform", 0.3, 1), 0.05);
  EXPECT_LT(obeyed("adaptive", 0.3, 1), 0.5);
  EXPECT_GT(obeyed("uniform", 0.3, 2), obeyed("uniform", 0.3, 1) + 0.2);
}

}  // namespace
}  // namespace tutti::robot
