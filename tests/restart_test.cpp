// SPDX-License-Identifier: BSD-3-Clause
// A robot that loses its state and a server that comes back from an older one, over the wire: the robot's new session
// is tied to the map by closures and corrected again, what was mapped stays, and the server is heard at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/evaluation/agreement.hpp"
#include "tutti/lab/closure_verifiers.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/server/map_server.hpp"
#include "tutti/simulation/recordings.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti {
namespace restart_test {

constexpr std::uint64_t kFirstSession = 1'700'000'000, kSecondSession = 1'700'000'300;

/// A robot in the midst of a recording. Each session's odometry begins at the origin.
struct Walker {
  const Recording* recording = nullptr;
  robot::RobotAgent agent;
  std::size_t first = 0;  ///< Sample that the session begins with.
  std::size_t next = 0;

  void walk_until(double time_s) {
    const Trajectory& odometry = recording->odometry;
    for (; next < odometry.size() && odometry[next].stamp - Timestamp{} < time_s; ++next)
      ASSERT_TRUE(agent
                      .add(OdometrySample{
                          odometry[next].stamp, odometry[first].pose.inverse() * odometry[next].pose,
                          next == first ? Matrix6d(Matrix6d::Zero()) : recording->increment_covariance[next - 1]})
                      .has_value());
  }
  void lose_state() {
    agent = robot::RobotAgent(recording->robot, kSecondSession, {});
    first = next;
  }
  [[nodiscard]] double rmse_m(const Trajectory& estimate) const {
    return evaluation::agreement(estimate, recording->reference)->rmse_m;
  }
};

class Restart : public testing::Test {
 protected:
  Restart() {
    simulation::SimulationConfig config;
    config.world.network = {.rows = 2, .columns = 3, .block_m = 15.0, .jitter_m = 2.0, .missing_share = 0.0};
    for (simulation::SimulatedRobotConfig& robot : config.robots) {
      robot.walk.duration_s = 400.0;
      robot.odometry.yaw_deg_per_sqrt_m = 1.0;  // enough to be worth correcting
    }
    auto world = simulation::simulate_recordings(config, Timestamp{0}, 11);
    EXPECT_TRUE(world.has_value());
    for (Recording& recording : world->recordings) {
      ids_.insert(recording.robot);
      recordings_.push_back({.recording = std::move(recording)});
    }
    lab::MissionConfig mission;
    mission.closure_changes.verifier = "reference";
    mission.closure_changes.reference.min_time_gap_s = 20.0;
    verifier_ = lab::make_closure_verifier(mission, recordings_, 5);
    for (const mission::MissionRecording& robot : recordings_)
      walkers_.push_back({&robot.recording, robot::RobotAgent(robot.recording.robot, kFirstSession, {})});
    server_ = std::make_unique<server::MapServer>(ids_, verifier_, payloads_, server::ServerConfig{}, 1);
  }

  void upload() {
    for (Walker& walker : walkers_)
      for (const SubmapMessage& message : walker.agent.take_outgoing()) {
        const auto decoded = wire::decode_submap(wire::encode(message));
        ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
        const Status taken = server_->receive(*decoded);
        ASSERT_TRUE(taken.has_value()) << taken.error().message;
      }
  }
  void answer_jobs() {
    for (const auto& job : server_->take_jobs()) {
      const auto verdict = verifier_->verify(*job.first, *job.second, *payloads_);
      ASSERT_TRUE(verdict.has_value()) << verdict.error().message;
      const auto decoded = wire::decode_verdict(wire::encode(*verdict));
      ASSERT_TRUE(decoded.has_value()) << decoded.error().message;
      ASSERT_TRUE(server_->receive(*decoded).has_value());
    }
  }
  ProxyGraphMessage broadcast() {
    const auto message = wire::decode_proxy_graph(wire::encode(server_->optimise()));
    EXPECT_TRUE(message.has_value()) << message.error().message;
    return *message;
  }
  void go_on_until(double time_s) {
    for (double t = last_s_ + 20.0; t <= time_s; t += 20.0) {
      for (Walker& walker : walkers_) walker.walk_until(t);
      upload();
      answer_jobs();
      const ProxyGraphMessage message = broadcast();
      for (Walker& walker : walkers_) walker.agent.receive(message);
    }
    last_s_ = time_s;
  }
  [[nodiscard]] Trajectory mapped(const ChainId& chain) const {
    Trajectory out;
    for (const MapNode& node : server_->map().nodes)
      if (node.id.chain == chain) out.push_back({node.stamp, node.T_world_body});
    return out;
  }

  std::set<RobotId> ids_;
  std::vector<mission::MissionRecording> recordings_;
  std::shared_ptr<const server::ClosureVerifier> verifier_;
  std::shared_ptr<server::PayloadStore> payloads_ = std::make_shared<server::MemoryPayloadStore>();
  std::unique_ptr<server::MapServer> server_;
  std::vector<Walker> walkers_;
  double last_s_ = 0.0;
};

TEST_F(Restart, ARobotWithoutItsStateIsMappedAndCorrectedAgain) {
  go_on_until(200.0);
  const ChainId old = walkers_[0].agent.chain();
  const Trajectory before = mapped(old);
  ASSERT_GT(before.size(), 100U);
  walkers_[0].lose_state();
  const ChainId fresh = walkers_[0].agent.chain();

  for (double t = 202.0; mapped(fresh).empty(); t += 2.0) {  // its first submap, no verdict yet
    ASSERT_LT(t, 240.0);
    walkers_[0].walk_until(t);
    upload();
    broadcast();
  }
  const Trajectory after = mapped(old);
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_LT(local(before[i].pose, after[i].pose).norm(), 1e-6) << i;

  go_on_until(400.0);
  EXPECT_EQ(server_->map().components, 1U);
  EXPECT_TRUE(server_->map().left_out.empty());
  EXPECT_EQ(mapped(old).size(), before.size());
  const Walker& walker = walkers_[0];
  Trajectory odometry;
  for (const Keyframe& keyframe : walker.agent.keyframes()) odometry.push_back({keyframe.stamp, keyframe.T_odom_body});
  RecordProperty("odometry_mm", static_cast<int>(1e3 * walker.rmse_m(odometry)));
  RecordProperty("corrected_mm", static_cast<int>(1e3 * walker.rmse_m(walker.agent.corrected())));
  EXPECT_GT(walker.agent.ledger().size(), 0U);
  EXPECT_LT(walker.rmse_m(walker.agent.corrected()), 0.5 * walker.rmse_m(odometry));
  EXPECT_LT(walker.rmse_m(mapped(fresh)), 0.5 * walker.rmse_m(odometry));
  ASSERT_EQ(walkers_[1].agent.whereabouts().size(), 1U);  // the robot, not each of its sessions
  EXPECT_GT(walkers_[1].agent.whereabouts()[0].stamp, mapped(old).back().stamp);
}

TEST_F(Restart, AServerBackFromAnOlderStateIsHeardAtOnce) {
  go_on_until(100.0);
  const server::MapServerState saved = server_->state();
  go_on_until(200.0);
  const ProxyGraphMessage late = wire::decode_proxy_graph(wire::encode(server_->optimise())).value();

  server_ = std::make_unique<server::MapServer>(ids_, verifier_, payloads_, server::ServerConfig{}, 1, saved);
  answer_jobs();
  const ProxyGraphMessage heard = broadcast();
  ASSERT_LT(heard.graph.revision, late.graph.revision);
  for (Walker& walker : walkers_) {
    EXPECT_GT(walker.agent.receive(heard).synchronised, 0U);
    const Trajectory corrected = walker.agent.corrected();
    EXPECT_EQ(walker.agent.receive(late).synchronised, 0U);  // of the old epoch, from a slow link
    EXPECT_EQ(walker.agent.receive(heard).synchronised, 0U);
    EXPECT_EQ(walker.agent.corrected(), corrected);
  }
}

}  // namespace restart_test
}  // namespace tutti
