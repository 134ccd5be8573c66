// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/agent.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/robot/drifting_robot.hpp"
#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/evaluation/agreement.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::robot {
namespace agent_test {

using namespace test;  // NOLINT: the robot and server of these tests

class AgentPolicies : public testing::TestWithParam<const char*> {};

TEST_P(AgentPolicies, CorrectsTheRobotFromAnUnrelatedFrame) {
  AgentConfig config;
  config.policy.name = GetParam();
  RobotAgent agent(RobotId{1}, 1, config);
  feed(agent, drifting_odometry(240));
  Trajectory truth;
  for (const Keyframe& k : agent.keyframes())
    truth.push_back({k.stamp, true_pose(static_cast<int>(std::lround((k.stamp - at(0)) / 0.5)))});
  const double before = evaluation::agreement(agent.corrected(), truth)->rmse_m;
  ASSERT_GT(before, 1.0);
  UpdateSummary summary;
  for (std::uint64_t revision = 1; revision <= 10; ++revision)
    summary = agent.receive(broadcast(agent, revision, kWorld));
  EXPECT_GT(summary.synchronised, 70U);
  EXPECT_GT(summary.constraints, 0U);
  EXPECT_LT(evaluation::agreement(agent.corrected(), truth)->rmse_m, 0.1 * before);
  EXPECT_LT(local(agent.keyframes().front().T_odom_body, agent.corrected().front().pose).norm(), 1e-9);
}

/// Odometry in the plane is unsure of height, roll and pitch; an unknown one is unsure of everything.
TEST_P(AgentPolicies, CorrectsOdometryInThePlaneAndOfUnknownHeight) {
  for (const double others : {0.0, 1e6, 1e20}) {
    AgentConfig config;
    config.policy.name = GetParam();
    RobotAgent agent(RobotId{1}, 1, config);
    Matrix6d covariance = kStepCovariance;
    for (const int axis : {2, 3, 4}) covariance(axis, axis) = others;
    Trajectory truth;
    for (const auto& [stamp, pose] : drifting_odometry(240)) {
      ASSERT_TRUE(agent.add(OdometrySample{stamp, pose, covariance}));
      truth.push_back({stamp, true_pose(static_cast<int>(truth.size()))});
    }
    const double before = evaluation::agreement(agent.corrected(), truth)->rmse_m;
    UpdateSummary summary;
    for (std::uint64_t revision = 1; revision <= 10; ++revision)
      summary = agent.receive(broadcast(agent, revision, kWorld));
    EXPECT_TRUE(estimation::is_usable(summary.optimised)) << to_string(summary.optimised);
    EXPECT_LT(evaluation::agreement(agent.corrected(), truth)->rmse_m, 0.15 * before) << others;
  }
}

/// Two sessions of three robots, side by side on one trajectory, the last of them in a map of its own.
ProxyGraphMessage everybodys(const RobotAgent& agent, std::uint64_t revision, bool reduced) {
  const ProxyGraphMessage sent = broadcast(agent, revision, kWorld);
  std::vector<consistency::ServerNode> nodes;
  std::vector<ChainComponent> components;
  for (const std::uint32_t robot : {0U, 1U, 9U, 12U})
    for (const std::uint64_t session : {agent.chain().session - 1, agent.chain().session}) {
      const ChainId chain{RobotId{robot}, session};
      const Pose3 aside{Eigen::Quaterniond::Identity(), {0.0, chain == agent.chain() ? 0.0 : 1.0 + robot, 0.0}};
      for (const ProxyNode& node : nodes_of(sent.graph, agent.chain()))
        nodes.push_back({chain, node.stamp, node.T_world_body * aside, node.covariance});
      components.push_back({chain, robot == 12U ? 1U : 0U});
    }
  const int budget = reduced ? static_cast<int>(nodes.size() * 2 / 3) : 0;
  ProxyGraphMessage message{
      .header = {}, .graph = consistency::build_proxy_graph(revision, nodes, components, {.node_budget = budget})};
  message.graph.uncertainties = {
      consistency::even_uncertainty(agent.chain(), nodes_of(message.graph, agent.chain()).size(), {0.002, 0.001})};
  return message;
}

// Nothing else in the whole graph matters to it, not even what is closer than the radius or reduced together.
TEST_P(AgentPolicies, DoesTheSameWithItsOwnPartOfTheGraph) {
  for (const bool reduced : {false, true}) {
    AgentConfig config;
    config.policy.name = GetParam();
    RobotAgent with_all(RobotId{1}, 1, config), with_own(RobotId{1}, 1, config);
    for (RobotAgent* agent : {&with_all, &with_own}) feed(*agent, drifting_odometry(240));
    for (std::uint64_t revision = 1; revision <= 3; ++revision) {
      const ProxyGraphMessage whole = everybodys(with_all, revision, reduced);
      EXPECT_EQ(whole.graph.reduced, reduced);
      const ProxyGraphMessage own{whole.header, consistency::own_part(whole.graph, RobotId{1})};
      EXPECT_LT(7 * own.graph.nodes.size(), whole.graph.nodes.size());
      const UpdateSummary all = with_all.receive(whole), part = with_own.receive(own);
      EXPECT_GT(part.constraints, 0U);
      EXPECT_EQ(part.synchronised, all.synchronised);
      EXPECT_EQ(part.ledger.added, all.ledger.added);
      EXPECT_EQ(part.explanation.origins.size(), all.explanation.origins.size());
    }
    EXPECT_EQ(with_own.corrected(), with_all.corrected());
    EXPECT_EQ(with_own.ledger(), with_all.ledger());
    ASSERT_EQ(with_own.whereabouts().size(), 2U);  // robots 0 and 9, and not 12
    ASSERT_EQ(with_all.whereabouts().size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(with_own.whereabouts()[i].robot, RobotId{i == 0 ? 0U : 9U});
      EXPECT_EQ(with_own.whereabouts()[i].stamp, with_all.whereabouts()[i].stamp);
      EXPECT_EQ(with_own.whereabouts()[i].T_map_body, with_all.whereabouts()[i].T_map_body);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, AgentPolicies, testing::Values("spectral", "every_node", "adaptive"));

/// The server's map turns where odometry does not; all covariances are odometry's, as of a map that hangs on one
/// closure. The map has weighed the two already: the robot follows it, whatever the policy.
TEST(Agent, FollowsTheMapAsFarAsItGoes) {
  for (const char* policy : {"adaptive", "every_node"}) {
    AgentConfig config;
    config.policy.name = policy;
    RobotAgent agent(RobotId{1}, 1, config);
    Trajectory odometry;
    for (int i = 0; i < 120; ++i) odometry.push_back({at(i), true_pose(0).inverse() * true_pose(i)});
    feed(agent, odometry);
    ProxyGraphMessage message = broadcast(agent, 1, kWorld, 2.0 * kStepCovariance);
    auto& nodes = message.graph.nodes;
    const Pose3 pivot = nodes[30].T_world_body;
    const Pose3 turn = pivot * Pose3{so3_exp(Eigen::Vector3d(0, 0, 0.3)), Eigen::Vector3d::Zero()} * pivot.inverse();
    for (std::size_t k = 31; k + 1 < nodes.size(); ++k) nodes[k].T_world_body = turn * nodes[k].T_world_body;
    const Pose3 asked = nodes.front().T_world_body.inverse() * nodes[nodes.size() - 2].T_world_body;
    EXPECT_GT(agent.receive(message).constraints, 0U) << policy;
    std::vector<Pose3> at_nodes;
    for (std::size_t k = 0; k < agent.keyframes().size(); ++k)
      if (agent.keyframes()[k].representative) at_nodes.push_back(agent.corrected()[k].pose);
    EXPECT_LT(local(asked, at_nodes.front().inverse() * at_nodes.back()).norm(), 1e-3) << policy;
  }
}

/// Drivers that leave the covariance at zero claim to be perfect, which server and robot believe up to the same sigma.
TEST(Agent, CorrectsOdometryThatClaimsToBePerfect) {
  RobotAgent agent(RobotId{1}, 1, {});
  Trajectory truth;
  for (const auto& [stamp, pose] : drifting_odometry(240)) {
    ASSERT_TRUE(agent.add(OdometrySample{stamp, pose, Matrix6d::Zero()}));
    truth.push_back({stamp, true_pose(static_cast<int>(truth.size()))});
  }
  const double before = evaluation::agreement(agent.corrected(), truth)->rmse_m;
  const Matrix6d stated = Vector6d(1e-8, 1e-8, 1e-8, 1e-10, 1e-10, 1e-10).asDiagonal();
  UpdateSummary summary;
  for (std::uint64_t revision = 1; revision <= 10; ++revision)
    summary = agent.receive(broadcast(agent, revision, kWorld, stated));
  EXPECT_TRUE(estimation::is_usable(summary.optimised)) << to_string(summary.optimised);
  EXPECT_LT(evaluation::agreement(agent.corrected(), truth)->rmse_m, 0.15 * before);
}

/// A map that is not a number somewhere, which no server sends by wire.
TEST(Agent, WhatCannotBeSolvedIsTakenBack) {
  AgentConfig config;
  config.policy.name = "every_node";
  config.explain = false;
  RobotAgent agent(RobotId{1}, 1, config);
  feed(agent, drifting_odometry(120));
  const Trajectory before = agent.corrected();
  ProxyGraphMessage message = broadcast(agent, 1, kWorld);
  message.graph.nodes[10].T_world_body.translation.x() = std::numeric_limits<double>::quiet_NaN();
  const auto summary = agent.receive(message);
  ASSERT_FALSE(estimation::is_usable(summary.optimised)) << to_string(summary.optimised);
  EXPECT_TRUE(summary.taken_back);
  EXPECT_EQ(summary.constraints, 0U);
  EXPECT_LT(evaluation::agreement(agent.corrected(), before)->max_m, 1e-6);
  EXPECT_GT(agent.receive(broadcast(agent, 2, kWorld)).constraints, 10U);
}

TEST(Agent, KnowsWhereTheOthersAre) {
  AgentConfig config;
  config.policy.name = "every_node";
  RobotAgent agent(RobotId{1}, 1, config);
  feed(agent, drifting_odometry(240));
  agent.receive(broadcast(agent, 1, kWorld));
  ASSERT_EQ(agent.whereabouts().size(), 1U);
  const Whereabouts& other = agent.whereabouts().front();
  EXPECT_EQ(other.robot, RobotId{9});
  const Pose3 expected = true_pose(0).inverse() * true_pose(7);  // the map starts at the first pose
  EXPECT_LT((other.T_map_body.translation - expected.translation).norm(), 0.2);
}

TEST(Agent, RobotsOfAnotherComponentAreNowhere) {
  RobotAgent agent(RobotId{1}, 1, {});
  feed(agent, drifting_odometry(60));
  ProxyGraphMessage message = broadcast(agent, 1, kWorld);
  message.graph.components[1].component = 1;
  agent.receive(message);
  EXPECT_TRUE(agent.whereabouts().empty());
}

TEST(Agent, AnOlderBroadcastChangesNothing) {
  RobotAgent agent(RobotId{1}, 1, {});
  feed(agent, drifting_odometry(240));
  agent.receive(broadcast(agent, 5, kWorld));
  const Trajectory corrected = agent.corrected();
  const auto ledger = agent.ledger();
  ProxyGraphMessage old = broadcast(agent, 4, kWorld);
  for (ProxyNode& node : old.graph.nodes) node.T_world_body.translation *= 1.5;
  EXPECT_EQ(agent.receive(old).synchronised, 0U);
  EXPECT_EQ(agent.receive(broadcast(agent, 5, kWorld)).synchronised, 0U);  // a duplicate
  EXPECT_EQ(agent.corrected(), corrected);
  EXPECT_EQ(agent.ledger(), ledger);
}

// Back from an older snapshot, the server counts revisions again that the robot has heard.
TEST(Agent, HearsAServerThatStartedAgainAtOnceAndNothingOfTheOldOneAfter) {
  RobotAgent agent(RobotId{1}, 1, {});
  feed(agent, drifting_odometry(240));
  const auto synchronised = [](RobotAgent& of, std::uint64_t epoch, std::uint64_t revision) {
    ProxyGraphMessage message = broadcast(of, revision, kWorld);
    message.graph.epoch = epoch;
    return of.receive(message).synchronised;
  };
  EXPECT_GT(synchronised(agent, 1, 20), 0U);
  EXPECT_GT(synchronised(agent, 2, 13), 0U);
  EXPECT_EQ(synchronised(agent, 1, 21), 0U);  // late
  EXPECT_EQ(synchronised(agent, 2, 13), 0U);  // repeated
  RobotAgent restored(RobotId{1}, {}, agent.state());
  EXPECT_EQ(synchronised(restored, 1, 22), 0U);
  EXPECT_EQ(synchronised(restored, 2, 12), 0U);
  EXPECT_GT(synchronised(restored, 2, 14), 0U);
  EXPECT_GT(synchronised(restored, 1'700'000'000, 1), 0U);
}

// Its older session has nodes of the same stamps, elsewhere, and so has another robot's.
TEST(Agent, SynchronisesWithItsOwnSessionAndSeesTheOthersInTheirNewest) {
  RobotAgent agent(RobotId{1}, 5, {});
  feed(agent, drifting_odometry(240));
  agent.finish();
  for (const SubmapMessage& sent : agent.take_outgoing()) {
    EXPECT_EQ(sent.header.session, 5U);
    EXPECT_EQ(sent.submap.id.chain, (ChainId{RobotId{1}, 5}));
  }
  ProxyGraphMessage message = broadcast(agent, 1, kWorld);
  std::vector<ProxyNode> older = message.graph.nodes;
  older.pop_back();  // robot 9
  for (ProxyNode& node : older) {
    node.chain.session = 4;
    node.T_world_body = kWorld * Pose3{Eigen::Quaterniond::Identity(), {1000, 0, 0}} * node.T_world_body;
  }
  ProxyNode newest = message.graph.nodes.back();
  newest.chain.session = 3;
  newest.stamp = at(2);  // its newest session, whatever the stamps
  newest.T_world_body = kWorld * true_pose(11);
  ProxyGraphMessage both = message;
  both.graph.nodes.insert(both.graph.nodes.begin(), older.begin(), older.end());
  both.graph.nodes.push_back(newest);
  both.graph.components = {{{RobotId{1}, 4}, 0}, {agent.chain(), 0}, {RobotId{9}, 1}, {newest.chain, 0}};
  both.graph.last_seen = {{agent.chain(), at(239), {}, "one"},
                          {newest.chain, newest.stamp, newest.T_world_body, "nine"}};

  RobotAgent alone(RobotId{1}, {}, agent.state());
  const UpdateSummary expected = alone.receive(message), update = agent.receive(both);
  EXPECT_GT(expected.synchronised, 70U);
  EXPECT_EQ(update.synchronised, expected.synchronised);
  EXPECT_EQ(agent.corrected(), alone.corrected());
  EXPECT_EQ(agent.ledger(), alone.ledger());
  ASSERT_EQ(agent.whereabouts().size(), 1U);
  EXPECT_EQ(agent.whereabouts()[0].robot, RobotId{9});
  EXPECT_EQ(agent.whereabouts()[0].stamp, at(2));
  EXPECT_EQ(agent.whereabouts()[0].name, "nine");
}

// 300 MB an hour otherwise, at 200 Hz.
TEST(Agent, KeepsKeyframesNotSamples) {
  const auto kept_after = [](int rate_hz, double seconds) {
    RobotAgent agent(RobotId{1}, 1, {});
    for (int i = 0; i <= static_cast<int>(seconds * rate_hz); ++i) {
      const double t = static_cast<double>(i) / rate_hz;
      const Pose3 pose{Eigen::Quaterniond::Identity(), {std::min(0.6 * t, 60.0), 0.0, 0.0}};  // stands at last
      EXPECT_TRUE(agent.add(OdometrySample{at(0) + t, pose, kStepCovariance / rate_hz}));
      agent.take_outgoing();
    }
    const AgentState state = agent.state();
    EXPECT_EQ(state.smoother.odometry.size(), agent.keyframes().size() - 1);
    EXPECT_EQ(agent.odometry_factors(), agent.keyframes().size() - 1);
    EXPECT_LE(state.submaps.recent.size(), static_cast<std::size_t>(SubmapBuilder::kHistory_s * rate_hz) + 2);
    EXPECT_LE(state.submaps.keyframes.size(), 40U);
    EXPECT_TRUE(state.submaps.finished.empty());
    return state.smoother.odometry.size() + state.smoother.constraints.size() + state.keyframes.size() +
           state.submap_of.size() + state.node_odometry.size();
  };
  const std::size_t slow = kept_after(10, 200.0), fast = kept_after(200, 200.0);
  EXPECT_NEAR(static_cast<double>(fast), static_cast<double>(slow), 0.1 * static_cast<double>(slow));
  EXPECT_LT(fast, 3U * (200U + 100U + 2U) + 200U);  // a keyframe per 0.3 m or second
}

TEST(Agent, SaysWhereTheRobotIsNow) {
  RobotAgent agent(RobotId{1}, 1, {});
  EXPECT_EQ(agent.T_map_body(), Pose3{});
  Pose3 T_map_odom;
  std::uint64_t revision = 0;
  const Trajectory odometry = fine_odometry(240);
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    ASSERT_TRUE(agent.add(OdometrySample{odometry[i].stamp, odometry[i].pose, kStepCovariance}));
    EXPECT_EQ(agent.T_map_odom(), T_map_odom);  // to the bit
    EXPECT_LT(local(agent.T_map_odom() * odometry[i].pose, agent.T_map_body()).norm(), 1e-12);
    if (agent.wants_scan()) {  // a keyframe
      EXPECT_LT(local(agent.corrected().back().pose, agent.T_map_body()).norm(), 1e-9);
    }
    if (i % 800 != 799) continue;
    agent.receive(broadcast(agent, ++revision, kWorld));
    EXPECT_GT(agent.ledger().size(), 0U);
    EXPECT_GT((agent.T_map_odom() * odometry[i].pose).translation.norm(), 0.0);
    EXPECT_GT(local(agent.T_map_odom(), T_map_odom).norm(), 1e-3);
    T_map_odom = agent.T_map_odom();
    EXPECT_EQ(RobotAgent(RobotId{1}, {}, agent.state()).T_map_body(), agent.T_map_body());
  }
  EXPECT_EQ(revision, 2U);
}

// The default policy uses none of it, and it takes longer than all the rest of an update.
TEST(Agent, ComparesGraphSignalsOnlyForPoliciesThatUseThem) {
  const auto order = [](const char* policy) {
    AgentConfig config;
    config.policy.name = policy;
    RobotAgent agent(RobotId{1}, 1, config);
    feed(agent, drifting_odometry(240));
    const UpdateSummary summary = agent.receive(broadcast(agent, 1, kWorld));
    EXPECT_GT(summary.synchronised, 70U);
    EXPECT_GT(summary.constraints, 0U);
    return summary.order;
  };
  EXPECT_EQ(order("adaptive"), 0);
  EXPECT_GT(order("spectral"), 0);
}

TEST(Agent, MapsOnWithoutAServerAndUploadsOnlyRawOdometry) {
  AgentConfig config;
  config.policy.name = "every_node";
  RobotAgent alone(RobotId{1}, 1, config);
  RobotAgent corrected(RobotId{1}, 1, config);
  const Trajectory odometry = drifting_odometry(240);
  for (const StampedPose& sample : odometry) {
    ASSERT_TRUE(alone.add(OdometrySample{sample.stamp, sample.pose, kStepCovariance}).has_value());
    ASSERT_TRUE(corrected.add(OdometrySample{sample.stamp, sample.pose, kStepCovariance}).has_value());
    if (sample.stamp == at(100)) corrected.receive(broadcast(corrected, 1, kWorld));
  }
  alone.finish();
  corrected.finish();
  const auto a = alone.take_outgoing();
  const auto b = corrected.take_outgoing();
  ASSERT_EQ(a.size(), b.size());
  ASSERT_GT(a.size(), 5U);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].header, b[i].header);
    EXPECT_EQ(a[i].header.sequence, i);
    EXPECT_EQ(a[i].submap.keyframes, b[i].submap.keyframes);
    EXPECT_EQ(a[i].submap.odometry, b[i].submap.odometry);
  }
  EXPECT_EQ(alone.corrected().size(), alone.keyframes().size());
  EXPECT_EQ(alone.odometry_factors(), alone.keyframes().size() - 1);
}

TEST(Agent, WhatItTakesTheServerTakes) {
  RobotAgent agent(RobotId{1}, 1, {});
  for (auto [stamp, pose] : drifting_odometry(60)) {
    pose.rotation.coeffs() *= 1.0 + 1e-5;  // five digits were printed
    ASSERT_TRUE(agent.add(OdometrySample{stamp, pose, kStepCovariance}));
  }
  agent.finish();
  const auto messages = agent.take_outgoing();
  ASSERT_FALSE(messages.empty());
  for (const SubmapMessage& message : messages)
    for (const Keyframe& keyframe : message.submap.keyframes) EXPECT_TRUE(is_valid(keyframe.T_odom_body));
  Matrix6d indefinite = kStepCovariance;
  indefinite(0, 5) = indefinite(5, 0) = 1.0;
  const Status refused = agent.add(OdometrySample{at(60), drifting_odometry(61).back().pose, indefinite});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("semidefinite"), std::string::npos) << refused.error().message;
}

TEST(Agent, AnEmptyAgentTakesABroadcast) {
  RobotAgent agent(RobotId{1}, 1, {});
  ProxyGraphMessage message;
  message.graph.revision = 1;
  message.graph.nodes.push_back({.chain = agent.chain(), .stamp = at(0)});
  EXPECT_EQ(agent.receive(message).synchronised, 0U);
  EXPECT_TRUE(agent.corrected().empty());
  EXPECT_EQ(agent.odometry_factors(), 0U);
}

}  // namespace agent_test
}  // namespace tutti::robot
