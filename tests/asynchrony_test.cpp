// SPDX-License-Identifier: BSD-3-Clause
// The map is a function of the set of messages, not of how they arrive: permuted, delayed, duplicated and batched at
// random, 100 times, a small mission ends in the same accepted closures and the same poses.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <numeric>
#include <vector>

#include "support/sanitized.hpp"
#include "tutti/base/random.hpp"
#include "tutti/lab/closure_verifiers.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/server/map_server.hpp"
#include "tutti/simulation/recordings.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti {
namespace asynchrony_test {

struct SmallMission {
  std::vector<mission::MissionRecording> recordings;
  std::set<RobotId> robots;
  std::vector<std::string> uploads;  // encoded submaps, in the order they were made
  std::shared_ptr<const server::ClosureVerifier> verifier;
};

SmallMission make_mission() {
  SmallMission out;
  simulation::SimulationConfig config;
  config.world.network = {.rows = 2, .columns = 3, .block_m = 15.0, .jitter_m = 2.0, .missing_share = 0.0};
  for (simulation::SimulatedRobotConfig& robot : config.robots) robot.walk.duration_s = 200.0;
  auto world = simulation::simulate_recordings(config, Timestamp{0}, 11);
  EXPECT_TRUE(world.has_value());
  for (Recording& recording : world->recordings) {
    out.robots.insert(recording.robot);
    robot::RobotAgent agent(recording.robot, 0, {});
    for (std::size_t i = 0; i < recording.odometry.size(); ++i)
      EXPECT_TRUE(agent
                      .add(OdometrySample{recording.odometry[i].stamp, recording.odometry[i].pose,
                                          i == 0 ? Matrix6d(Matrix6d::Zero()) : recording.increment_covariance[i - 1]})
                      .has_value());
    agent.finish();
    for (const SubmapMessage& message : agent.take_outgoing()) out.uploads.push_back(wire::encode(message));
    out.recordings.push_back({.recording = std::move(recording)});
  }
  lab::MissionConfig mission;
  mission.closure_changes.verifier = "reference";
  mission.closure_changes.reference.wrong_share = 0.2;
  mission.closure_changes.reference.min_time_gap_s = 20.0;
  out.verifier = lab::make_closure_verifier(mission, out.recordings, 5);
  return out;
}

server::MapEstimate final_map(server::MapServer& server) {
  server.optimise();
  return server.map();
}

/// Every message once, in order, verdicts at once.
server::MapEstimate map_in_order(const SmallMission& mission) {
  server::MapServer server(mission.robots, mission.verifier, std::make_shared<server::MemoryPayloadStore>(), {}, 1);
  for (const std::string& bytes : mission.uploads) {
    EXPECT_TRUE(server.receive(*wire::decode_submap(bytes)).has_value());
    for (const auto& job : server.take_jobs())
      EXPECT_TRUE(server.receive(*mission.verifier->verify(*job.first, *job.second, server.payloads())).has_value());
  }
  return final_map(server);
}

/// Shuffled submaps, a fifth of them twice, verdicts delayed and shuffled, an optimisation now and then.
server::MapEstimate map_in_disorder(const SmallMission& mission, Rng rng) {
  const auto shuffle = [&rng](auto& list) {
    for (std::size_t i = list.size(); i > 1; --i) std::swap(list[i - 1], list[rng.index(i)]);
  };
  std::vector<std::string> uploads = mission.uploads;
  for (const std::string& bytes : mission.uploads)
    if (rng.bernoulli(0.2)) uploads.push_back(bytes);
  shuffle(uploads);

  server::MapServer server(mission.robots, mission.verifier, std::make_shared<server::MemoryPayloadStore>(), {}, 1);
  std::vector<ClosureVerdict> late;
  const auto hand_in = [&](double share) {
    shuffle(late);
    const auto keep = static_cast<std::ptrdiff_t>(share * static_cast<double>(late.size()));
    for (auto verdict = late.begin() + keep; verdict != late.end(); ++verdict) {
      EXPECT_TRUE(server.receive(*verdict).has_value());
      if (rng.bernoulli(0.2)) {
        EXPECT_TRUE(server.receive(*verdict).has_value());
      }
    }
    late.erase(late.begin() + keep, late.end());
  };
  for (const std::string& bytes : uploads) {
    EXPECT_TRUE(server.receive(*wire::decode_submap(bytes)).has_value());
    for (const auto& job : server.take_jobs())
      late.push_back(*mission.verifier->verify(*job.first, *job.second, server.payloads()));
    if (rng.bernoulli(0.3)) hand_in(rng.uniform(0.0, 1.0));
    if (rng.bernoulli(0.03)) server.optimise();
  }
  hand_in(0.0);
  return final_map(server);
}

std::vector<std::pair<KeyframeId, KeyframeId>> accepted(const server::MapEstimate& map) {
  std::vector<std::pair<KeyframeId, KeyframeId>> out;
  for (const server::JudgedClosure& judged : map.closures)
    if (judged.accepted) out.emplace_back(judged.closure.from, judged.closure.to);
  return out;
}

TEST(Asynchrony, AHundredDisorderlyDeliveriesEndInTheSameMap) {
  const SmallMission mission = make_mission();
  const server::MapEstimate expected = map_in_order(mission);
  ASSERT_EQ(expected.components, 1U);
  ASSERT_GT(accepted(expected).size(), 10U);
  ASSERT_LT(accepted(expected).size(), expected.closures.size());  // there is something to reject
  for (std::uint64_t seed = 0; seed < tutti::seeds(100U); ++seed) {
    const server::MapEstimate map = map_in_disorder(mission, Rng(seed));
    ASSERT_EQ(accepted(map), accepted(expected)) << "seed " << seed;
    ASSERT_EQ(map.nodes.size(), expected.nodes.size()) << "seed " << seed;
    for (std::size_t i = 0; i < map.nodes.size(); ++i)
      ASSERT_LT((map.nodes[i].T_world_body.translation - expected.nodes[i].T_world_body.translation).norm(), 1e-3)
          << "seed " << seed << ", node " << i;
  }
}

}  // namespace asynchrony_test
}  // namespace tutti
