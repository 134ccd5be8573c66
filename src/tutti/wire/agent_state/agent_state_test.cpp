// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/agent_state/agent_state.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "support/robot/drifting_robot.hpp"
#include "tutti/base/random.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"

namespace tutti::wire {
namespace agent_state_test {

using robot::RobotAgent;
using robot::test::at;

constexpr RobotId kRobot{1};

/// Images of one camera that tracks a few points.
TrackedImages images_at(Timestamp stamp, Rng& rng) {
  TrackedImage image;
  for (std::uint64_t track = 0; track < 5; ++track)
    image.keypoints.push_back({{100.0F + static_cast<float>(rng.normal()), 50.0F}, 0.8F, track});
  const std::vector<Camera> cameras{
      {.model = {CameraKind::pinhole, 752, 480, 458.0, 457.0, 367.0, 248.0, {}}, .T_body_camera = {}}};
  return {stamp,
          std::make_shared<const std::vector<Camera>>(cameras),
          {image},
          {{stamp, Eigen::Vector3d::Constant(rng.normal()), Eigen::Vector3d::Constant(9.81)}},
          {}};
}

/// A robot's mission, sample by sample: images and perhaps scans at keyframes, a proxy graph now and then, submaps
/// taken late.
struct Mission {
  robot::AgentConfig config;
  Trajectory odometry = robot::test::drifting_odometry(70);
  std::uint64_t seed = 0;
  bool has_radio = false;
  double sensors_after_s = 0.0;  ///< The samples: at, before or after their stamps.

  [[nodiscard]] RobotAgent start() const { return {kRobot, 7, config}; }
  [[nodiscard]] RobotAgent go_on(robot::AgentState state) const { return {kRobot, config, std::move(state)}; }

  /// Returns all that the robot sends meanwhile.
  std::string live(RobotAgent& agent, std::size_t from, std::size_t to) const {
    std::string sent;
    for (std::size_t i = from; i < to; ++i) {
      Rng rng = Rng(seed).fork(i);
      EXPECT_TRUE(
          agent.add(OdometrySample{odometry[i].stamp, odometry[i].pose, robot::test::kStepCovariance}).has_value());
      const Timestamp stamp = odometry[i].stamp + (i == 0 ? 0.0 : sensors_after_s);
      if (agent.wants_scan(stamp) && rng.bernoulli(0.5)) {
        PointCloud cloud;
        for (int p = 0; p < 20; ++p) cloud.points.push_back(3.0F * Eigen::Vector3d(rng.normal(), 1, 2).cast<float>());
        EXPECT_TRUE(agent.add(Scan{stamp, std::make_shared<const PointCloud>(cloud), {}}).has_value());
      }
      if (agent.wants_images(stamp)) {
        EXPECT_TRUE(agent.add(images_at(stamp, rng)).has_value());
      }
      if (i % 3 == 1) {
        EXPECT_TRUE(
            agent.add(PositionFix{.stamp = stamp, .antenna = {46.5, 7.9, 1.0 * static_cast<double>(i)}}).has_value());
      }
      if (has_radio) {
        EXPECT_TRUE(agent.add(RobotRange{.stamp = stamp, .to = RobotId{9}, .distance_m = 1.0 + rng.uniform(0.0, 1.0)})
                        .has_value());
      }
      if (rng.bernoulli(0.05)) {
        ProxyGraphMessage message = robot::test::broadcast(agent, i, robot::test::kWorld);
        for (ProxyNode& node : message.graph.nodes) node.T_world_body.translation.x() += 0.05 * rng.normal();
        message.graph.last_seen.front().name = "nine";
        const auto summary = agent.receive(message);
        sent += std::to_string(summary.constraints) + ' ';
      }
      if (rng.bernoulli(0.1))
        for (const SubmapMessage& submap : agent.take_outgoing()) sent += encode(submap);
    }
    return sent;
  }
};

Mission any_mission() {
  Mission mission{.seed = *rc::gen::arbitrary<std::uint32_t>()};
  mission.config.policy.name = *rc::gen::element<std::string>("adaptive", "spectral", "every_node");
  mission.config.submap.duration_s = 6.0;
  mission.sensors_after_s = *rc::gen::element(0.0, -0.2, 0.1);
  mission.has_radio = *rc::gen::element(false, true);
  return mission;
}

robot::AgentState decoded(const robot::AgentState& state) {
  const auto back = decode_agent_state(encode(state));
  EXPECT_TRUE(back.has_value()) << back.error().message;
  return *back;
}

RC_GTEST_PROP(AgentState, ComesBackToTheBit, ()) {
  const Mission mission = any_mission();
  RobotAgent agent = mission.start();
  mission.live(agent, 0, *rc::gen::inRange<std::size_t>(0, mission.odometry.size()));
  const robot::AgentState state = agent.state(), back = decoded(state);
  RC_ASSERT(back.smoother.poses == state.smoother.poses);
  RC_ASSERT(back.smoother.constraints == state.smoother.constraints);
  RC_ASSERT(back.ledger == state.ledger);
  RC_ASSERT(back.keyframes == state.keyframes);
  RC_ASSERT(back.node_odometry == state.node_odometry);
  RC_ASSERT(back.submaps.recent == state.submaps.recent);
  RC_ASSERT(back.submaps.ranges == state.submaps.ranges);
  RC_ASSERT(back.submaps.finished.size() == state.submaps.finished.size());
  RC_ASSERT(back.whereabouts.size() == state.whereabouts.size());
  RC_ASSERT(std::ranges::equal(back.whereabouts, state.whereabouts, {}, &robot::Whereabouts::name,
                               &robot::Whereabouts::name));
  RC_ASSERT(back.sequence == state.sequence);
  RC_ASSERT(encode(back) == encode(state));
}

RC_GTEST_PROP(AgentState, AnAgentGoesOnFromItAsIfNothingHadHappened, ()) {
  const Mission mission = any_mission();
  const std::size_t end = mission.odometry.size(), middle = *rc::gen::inRange<std::size_t>(0, end);
  RobotAgent whole = mission.start();
  mission.live(whole, 0, middle);
  RobotAgent restored = mission.go_on(decoded(whole.state()));
  RC_ASSERT(mission.live(restored, middle, end) == mission.live(whole, middle, end));
  RC_ASSERT(restored.corrected() == whole.corrected());
  RC_ASSERT(encode(restored.state()) == encode(whole.state()));
}

/// Rows as a store has them.
struct Rows {
  StateRows rows;
  StoredState stored;
  void store(const RobotAgent& agent) {
    StateChange change = changed_rows(agent, stored);
    for (const std::string& key : change.removed) rows.erase(key);
    for (auto& [key, bytes] : change.put) rows.insert_or_assign(key, std::move(bytes));
  }
};

RC_GTEST_PROP(AgentState, RowsWrittenNowAndThenAreTheWholeStateToTheBit, ()) {
  const Mission mission = any_mission();
  RobotAgent agent = mission.start();
  Rows all;
  all.store(agent);
  for (std::size_t at = 0; at < mission.odometry.size();) {
    const std::size_t next = std::min(at + *rc::gen::inRange<std::size_t>(1, 30), mission.odometry.size());
    mission.live(agent, at, next);
    at = next;
    all.store(agent);
    const auto back = decode_state_rows(all.rows);
    RC_ASSERT(back.has_value());
    RobotAgent restored = mission.go_on(*back);
    RC_ASSERT(encode(restored.state()) == encode(agent.state()));
    RC_ASSERT(restored.smoother() == agent.smoother());
    if (*rc::gen::arbitrary<bool>()) continue;
    agent = std::move(restored);  // a kill
    all.stored = stored_state(*back);
  }
}

TEST(AgentState, RowsThatDoNotBelongTogetherAreRefused) {
  Mission mission{.seed = 3};
  mission.config.submap.duration_s = 6.0;
  RobotAgent agent = mission.start();
  Rows all;
  std::vector<StateRows> versions;
  for (std::size_t at = 0; at < 60; at += 10) {
    mission.live(agent, at, at + 10);
    all.store(agent);
    versions.push_back(all.rows);
  }
  ASSERT_TRUE(decode_state_rows(all.rows).has_value());
  EXPECT_TRUE(std::ranges::any_of(all.rows, [](const auto& row) { return row.first.starts_with("link/"); }));
  for (const auto& [key, bytes] : all.rows) {
    StateRows bad = all.rows;
    bad.erase(key);
    EXPECT_TRUE(key.starts_with("link/") || !decode_state_rows(bad).has_value()) << key;
    bad[key] = bytes.substr(0, bytes.size() / 2);
    EXPECT_FALSE(decode_state_rows(bad).has_value()) << key;
    for (const StateRows& other : versions)
      for (const auto& [other_key, other_bytes] : other) {
        bad[key] = other_bytes;
        if (const auto state = decode_state_rows(bad)) {
          RobotAgent restored = mission.go_on(*state);
          static_cast<void>(restored.add(OdometrySample{at(1000), {}, robot::test::kStepCovariance}));
          ASSERT_FALSE(encode(restored.state()).empty());
        }
      }
  }
}

TEST(AgentState, TheMissionsOfTheseTestsHaveEverythingInThem) {
  Mission mission{.seed = 3, .has_radio = true};
  RobotAgent agent = mission.start();
  mission.live(agent, 0, 70);
  const robot::AgentState state = agent.state();
  EXPECT_GT(state.ledger.size(), 0U);
  EXPECT_GT(state.submaps.scans.size() + state.submaps.finished.size(), 0U);
  EXPECT_EQ(state.whereabouts.size(), 1U);
  EXPECT_GT(state.comparisons, 2U);
  EXPECT_GT(state.submaps.fixes.size(), 0U);
  EXPECT_GT(state.submaps.ranges.size(), 0U);
}

TEST(AgentState, AnyChangeOfTheNumbersIsRefusedOrMakesAStateToGoOnFrom) {
  Mission mission{.seed = 3};
  mission.config.submap.duration_s = 6.0;
  RobotAgent agent = mission.start();
  mission.live(agent, 0, 60);
  v1::AgentState good;
  ASSERT_TRUE(good.ParseFromString(*unpack_frame(MessageKind::agent_state, encode(agent.state()))));
  Rng rng(1);
  int accepted = 0;
  for (int round = 0; round < 600; ++round) {
    v1::AgentState bad = good;
    for (std::uint64_t edits = 1 + rng.index(2); edits > 0; --edits) {
      const auto index = [&](int size) { return static_cast<int>(rng.index(static_cast<std::uint64_t>(size))); };
      if (rng.bernoulli(0.6))
        bad.set_integer(index(bad.integer_size()), rng.bernoulli(0.5) ? rng.index(200) : ~rng.index(1000));
      else
        bad.set_number(index(bad.number_size()), rng.bernoulli(0.5) ? rng.normal() : std::nan(""));
      if (rng.bernoulli(0.05)) bad.mutable_integer()->RemoveLast();
    }
    const auto state = decode_agent_state(pack_frame(MessageKind::agent_state, bad.SerializeAsString()));
    if (!state) {
      ASSERT_TRUE(state.error().message.starts_with("agent state: ")) << state.error().message;
      continue;
    }
    ++accepted;
    RobotAgent restored = mission.go_on(*state);
    static_cast<void>(restored.add(OdometrySample{at(1000), {}, robot::test::kStepCovariance}));
    ASSERT_FALSE(encode(restored.state()).empty());
  }
  EXPECT_GT(accepted, 20);
  EXPECT_LT(accepted, 580);
}

TEST(AgentState, OtherBytesAreRefused) {
  const std::string frame = encode(Mission{}.start().state());
  for (std::size_t size = 0; size < frame.size(); ++size)
    EXPECT_FALSE(decode_agent_state(std::string_view(frame).substr(0, size)).has_value());
  EXPECT_FALSE(decode_agent_state(pack_frame(MessageKind::agent_state, "")).has_value());
  EXPECT_FALSE(
      decode_agent_state(
          encode(ClosureVerdict{.pair = {{RobotId{0}, 0}, {RobotId{0}, 1}}, .closures = {}, .refusal = Refusal{}}))
          .has_value());
}

}  // namespace agent_state_test
}  // namespace tutti::wire
