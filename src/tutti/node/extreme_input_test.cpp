// SPDX-License-Identifier: BSD-3-Clause
// Whatever a robot is fed that it does not refuse, its store can be read again, and so can the server's that hears it.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "support/node/submaps.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/base/random.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/agent_state/agent_state.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace extreme_input_test {

constexpr RobotId kRobot{1};

template <class T, std::size_t N>
T one_of(Rng& rng, const T (&values)[N]) {
  return values[rng.index(N)];
}

/// Up to the largest that is taken, and a little beyond.
double any_coordinate(Rng& rng) {
  const double size = one_of(rng, {0.0, 1e-320, 1e-9, 1.0, 1.0, 1.0, 1e3, 1e6, 1e9, kMaxCoordinate_m, 2e9, 1e300});
  return size >= 1e9 ? std::copysign(size, rng.normal()) : size * rng.normal();
}

Pose3 any_extreme_pose(Rng& rng) {
  Pose3 T;
  for (double& x : T.translation) x = any_coordinate(rng);
  for (double& x : T.rotation.coeffs()) x = rng.normal();
  T.rotation.normalize();
  if (rng.bernoulli(0.3)) T.rotation.coeffs() *= 1.0 + 5e-4 * std::tanh(rng.normal());  // printed with few digits
  return T;
}

Matrix6d any_extreme_covariance(Rng& rng) {
  if (rng.bernoulli(0.3)) {
    Matrix6d a;
    for (double& x : a.reshaped()) x = rng.normal();
    return a * a.transpose() * one_of(rng, {1e-30, 1e-6, 1.0, 1e10, 1e250});
  }
  Vector6d variances;
  for (double& v : variances) v = one_of(rng, {0.0, 1e-320, 1e-12, 1e-4, 1.0, 1e20, 1e300});
  return variances.asDiagonal();
}

PointCloud any_extreme_cloud(Rng& rng) {
  PointCloud cloud;
  for (int i = 0; i < 5; ++i) {
    Eigen::Vector3f point;
    for (float& x : point)
      x = static_cast<float>(rng.normal()) * one_of(rng, {0.0F, 1e-40F, 1.0F, 20.0F, 1e30F, 3e38F});
    cloud.points.push_back(point);
  }
  return cloud;
}

struct Robot {
  explicit Robot(std::uint64_t seed) : rng(seed) { open(); }
  Status open() {
    store = std::make_unique<storage::MemoryStore>(storage::robot_schema(),
                                                   store ? store->tables() : storage::MemoryStore::Tables{});
    auto opened = RobotNode::open(kRobot, 7, config, *store);
    if (!opened) return tl::unexpected(opened.error());
    node = std::move(*opened);
    done(node->resume(now));
    return {};
  }
  void done(Step step) {
    EXPECT_TRUE(store->commit(step.writes).has_value());
    for (bus::Envelope& message : step.messages) sent.push_back(std::move(message));
  }
  /// Taken samples so far.
  void live(int samples) {
    for (int i = 0; i < samples; ++i) {
      now = now + 0.2;
      const bool is_far = rng.bernoulli(0.05);  // not more often: what is taken next has to confirm it
      stamp = stamp + (is_far ? one_of(rng, {1e5, 1e9}) : one_of(rng, {1e-9, 0.01, 0.5, 2.0}));
      done(node->add(OdometrySample{stamp, any_extreme_pose(rng), any_extreme_covariance(rng)}, now));
      if (node->agent().newest_sample() == stamp) ++taken;
      if (node->agent().wants_scan())
        done(node->add(Scan{stamp, std::make_shared<const PointCloud>(any_extreme_cloud(rng)), {}}, now));
      if (rng.bernoulli(0.1)) hear();
    }
  }
  /// A graph of what the robot has, as a server far away might see it.
  void hear() {
    ProxyGraphMessage message = robot::test::broadcast(node->agent(), ++revision, {});
    for (ProxyNode& node_of : message.graph.nodes) {
      do node_of.T_world_body = any_extreme_pose(rng);
      while (node_of.T_world_body.translation.cwiseAbs().maxCoeff() > kMaxCoordinate_m);
      node_of.T_world_body.rotation.normalize();
      do node_of.covariance = any_extreme_covariance(rng);
      while (node_of.covariance.cwiseAbs().maxCoeff() > 1e20);
    }
    message.graph.nodes.back().stamp = {};
    message.graph.last_seen.front().T_world_body = message.graph.nodes.back().T_world_body;
    for (auto& uncertainty : message.graph.uncertainties)
      uncertainty.whole.position_m = one_of(rng, {0.0, 1.0, 1e9, 1e300});
    if (!wire::validate(message)) return;
    ++heard;
    done(node->receive(test::from_server(kRobot, bus::MessageKind::proxy_graph, wire::encode(message)), now));
  }

  Rng rng;
  RobotNodeConfig config{.agent = {.submap = {.duration_s = 3.0}}};
  std::unique_ptr<storage::MemoryStore> store;
  std::unique_ptr<RobotNode> node;
  std::vector<bus::Envelope> sent;
  Timestamp now;
  Timestamp stamp{1'700'000'000'000'000'000LL};
  std::uint64_t revision = 0;
  int taken = 0, heard = 0;
};

RC_GTEST_PROP(ExtremeInput, WhatARobotHasStoredItCanRead, ()) {
  Robot robot(*rc::gen::arbitrary<std::uint32_t>());
  for (int round = 0; round < 4; ++round) {
    robot.live(*rc::gen::inRange(1, 25));
    robot.done(robot.node->store_all());
    const std::string before = wire::encode(robot.node->agent().state());
    const Status opened = robot.open();
    RC_ASSERT(opened.has_value());
    RC_ASSERT(wire::encode(robot.node->agent().state()) == before);
  }
}

TEST(ExtremeInput, TheseInputsAreTakenAndHeard) {
  Robot robot(1);
  robot.live(200);
  EXPECT_GT(robot.taken, 40);
  EXPECT_GT(robot.heard, 5);
  EXPECT_GT(robot.sent.size(), 2U);
}

RC_GTEST_PROP(ExtremeInput, AServerThatHearsItGoesOnToo, ()) {
  Robot robot(*rc::gen::arbitrary<std::uint32_t>());
  robot.live(60);
  robot.done(robot.node->finish(robot.now));
  storage::MemoryStore::Tables tables;
  Timestamp now = robot.now;  // one clock: the robot reports how long ago it received a graph
  for (int round = 0; round < 2; ++round) {
    storage::MemoryStore store(storage::map_schema(), tables);
    auto node = ServerNode::open({kRobot}, std::make_shared<test::EvenVerifier>(), {}, 1000 + round, store);
    RC_ASSERT(node.has_value());
    const auto done = [&](const Step& step) { RC_ASSERT(store.commit(step.writes).has_value()); };
    done((*node)->resume(now));
    for (const bus::Envelope& message : robot.sent) {
      done((*node)->receive(message, now));
      now = now + 1.0;
    }
    done((*node)->receive({bus::Endpoint::of(kRobot),
                           bus::Endpoint::server(),
                           bus::MessageKind::status,
                           {},
                           std::make_shared<const std::string>(wire::encode(robot.node->status(now)))},
                          now));
    for (int i = 0; i < 100; ++i)
      if (const auto next = (*node)->next_timer()) {
        now = std::max(now, *next);
        done((*node)->on_timer(now));
      }
    tables = store.tables();
  }
}

TEST(ExtremeInput, ASampleBeyondAllCoordinatesIsRefusedAndSaysSo) {
  Robot robot(1);
  for (const double far : {1.0001 * kMaxCoordinate_m, 1e300, std::numeric_limits<double>::max()}) {
    Pose3 T;
    T.translation.y() = -far;
    const Step step = robot.node->add(OdometrySample{robot.stamp, T, Matrix6d::Zero()}, robot.now);
    ASSERT_EQ(step.events.size(), 1U);
    const std::string& why = std::get<SampleRefused>(step.events.front().what).why;
    EXPECT_NE(why.find("at most 1000000000 m"), std::string::npos) << why;
    EXPECT_FALSE(robot.node->agent().newest_sample().has_value());
  }
}

}  // namespace extreme_input_test
}  // namespace tutti::node
