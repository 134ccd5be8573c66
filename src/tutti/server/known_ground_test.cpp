// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/known_ground.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "support/server/world.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::server {
namespace known_ground_test {

constexpr int kVisits = 2;

ServerConfig config_with(int visits) {
  ServerConfig out;
  out.map.known_ground.visits = visits;
  out.map.known_ground.reach_m = 4.5;
  return out;
}

/// Robots that walk round the same circle one after the other, each in the circle's middle lane: number 0 to 2.
std::vector<Submap> round_of(std::uint32_t turn, std::uint64_t seed = 5) {
  const ChainId chain(RobotId{turn % 3}, turn / 3);
  std::vector<Submap> out = test::make_submaps(chain, {}, Rng(seed).fork(turn));
  for (Submap& submap : out)
    for (Keyframe& keyframe : submap.keyframes) keyframe.stamp.ns += 1'000'000'000'000LL * turn;
  return out;
}

class Fleet {
 public:
  explicit Fleet(int visits, std::uint32_t wrong_every = 0)
      : verifier_(std::make_shared<const test::TestVerifier>(7, wrong_every)),
        server_({RobotId{0}, RobotId{1}, RobotId{2}}, verifier_, std::make_shared<MemoryPayloadStore>(),
                config_with(visits), 1) {}

  void take(const Submap& submap) {
    const ChainId chain = submap.id.chain;
    ASSERT_TRUE(server_.receive(SubmapMessage{{chain.robot, chain.session, 0}, submap}));
    for (const VerificationJob& job : server_.take_jobs()) {
      ++verified_;
      ASSERT_TRUE(server_.receive(*verifier_->verify(*job.first, *job.second, server_.payloads())));
    }
    server_.optimise();
    retired_ += server_.take_retired().submaps.size();
  }
  void drive(std::uint32_t turn) {
    for (const Submap& submap : round_of(turn)) take(submap);
  }
  [[nodiscard]] std::size_t kept() const { return server_.state().submaps.size() - server_.state().retired.size(); }
  MapServer& server() { return server_; }
  std::shared_ptr<const test::TestVerifier> verifier_;
  std::size_t verified_ = 0, retired_ = 0;

 private:
  MapServer server_;
};

/// Without anything retired it is 0.28 to 0.34 m here, as odometry is as bad as that. The worst error of a step of
/// about ten metres between nodes that lie so in one chain.
double worst_m(const MapEstimate& map) {
  double worst = 0.0;
  for (std::size_t i = 10; i < map.nodes.size(); ++i) {
    const MapNode &a = map.nodes[i - 10], &b = map.nodes[i];
    if (a.id.chain != b.id.chain) continue;
    const auto true_of = [](const KeyframeId& id) { return test::true_pose(id.chain.robot, id.index); };
    const Pose3 error =
        (true_of(a.id).inverse() * true_of(b.id)).inverse() * (a.T_world_body.inverse() * b.T_world_body);
    worst = std::max(worst, error.translation.norm());
  }
  return worst;
}

TEST(KnownGround, WhatOthersHaveShownIsRetiredAndItsRobotLocalised) {
  Fleet fleet(kVisits);
  for (std::uint32_t turn = 0; turn < 3; ++turn) fleet.drive(turn);
  const std::size_t before = fleet.kept();
  const std::size_t verified = fleet.verified_;
  fleet.drive(3);
  const std::size_t of_round = fleet.verified_ - verified;
  const auto& state = fleet.server().state();
  const auto latest = round_of(3);
  EXPECT_FALSE(state.retired.contains(latest.back().id)) << "what follows it may lead elsewhere";
  EXPECT_GT(state.retired.size(), 5U);
  EXPECT_LE(fleet.kept(), before + 2);
  EXPECT_EQ(fleet.retired_, state.retired.size());
  std::size_t laid = 0;
  for (const MapNode& node : fleet.server().map().nodes) laid += node.id.chain == latest.front().id.chain;
  EXPECT_EQ(laid, 91U) << "the robot is in the map all the same";
  EXPECT_EQ(fleet.server().map().components, 1U);
  EXPECT_LT(worst_m(fleet.server().map()), 0.35);
  EXPECT_GT(of_round, 0U) << "to be localised it has to be compared";
}

TEST(KnownGround, CostsNoMoreHoweverOftenItIsDriven) {
  Fleet fleet(kVisits);
  std::vector<std::size_t> kept, verified;
  for (std::uint32_t turn = 0; turn < 9; ++turn) {
    const std::size_t before = fleet.verified_;
    fleet.drive(turn);
    kept.push_back(fleet.kept());
    verified.push_back(fleet.verified_ - before);
  }
  EXPECT_LE(kept.back(), kept[3] + 3) << "of each robot the last submap waits for what follows";
  EXPECT_EQ(fleet.server().map().components, 1U);
  EXPECT_LE(fleet.server().map().nodes.size(), 720U);
  EXPECT_LE(verified.back(), 2 * verified[3]);
  EXPECT_LT(worst_m(fleet.server().map()), 0.4);
  Fleet all(0);
  for (std::uint32_t turn = 0; turn < 6; ++turn) all.drive(turn);
  EXPECT_EQ(all.server().state().retired.size(), 0U);
  EXPECT_EQ(all.kept(), all.server().state().submaps.size());
}

TEST(KnownGround, WhatIsHiddenLeavesAStepOfOdometry) {
  SubmapSet submaps;
  for (const Submap& submap : round_of(1)) submaps.emplace(submap.id, std::make_shared<const Submap>(submap));
  const ChainId chain = submaps.begin()->first.chain;
  const SubmapSet all = without_hidden(submaps, {});
  EXPECT_EQ(all, submaps);
  const SubmapSet some = without_hidden(submaps, {{chain, 0}, {chain, 3}, {chain, 4}, {chain, 8}});
  ASSERT_EQ(some.size(), 6U) << "what begins and ends a chain leaves nothing";
  const Submap& step = *some.at({chain, 3});
  ASSERT_EQ(step.keyframes.size(), 2U);
  EXPECT_EQ(step.keyframes.front(), submaps.at({chain, 2})->keyframes.back());
  EXPECT_EQ(step.keyframes.back(), submaps.at({chain, 5})->keyframes.front());
  const Pose3 by_poses = step.keyframes.front().T_odom_body.inverse() * step.keyframes.back().T_odom_body;
  EXPECT_LT(local(by_poses, step.odometry.front().T_a_b).norm(), 1e-9);
  EXPECT_GT(step.odometry.front().covariance(0, 0), 19 * 0.02 * 0.02) << "twenty steps err by what they err together";
  const MapEstimate map = estimate_map(some, {}, {});
  EXPECT_EQ(map.components, 1U) << "the chain has no gap";
}

TEST(KnownGround, AServerGoesOnWithWhatItHadRetired) {
  Fleet fleet(kVisits);
  for (std::uint32_t turn = 0; turn < 4; ++turn) fleet.drive(turn);
  MapServerState state = fleet.server().state();
  ASSERT_FALSE(state.retired.empty());
  state.answered = {};  // as a store has it: what was dropped is not in it
  for (const auto& [pair, verdict] : state.verdicts) {
    state.answered.add_submap(pair.first);
    state.answered.add_submap(pair.second);
    state.answered.insert(pair);
  }
  MapServer again({RobotId{0}, RobotId{1}, RobotId{2}}, fleet.verifier_, std::make_shared<MemoryPayloadStore>(),
                  config_with(kVisits), 2, state);
  for (const VerificationJob& job : again.take_jobs()) {
    EXPECT_FALSE(state.retired.contains(job.pair.first));
    EXPECT_FALSE(state.retired.contains(job.pair.second));
  }
  const MapEstimate before =
      estimate_known_map(state.submaps, state.retired, state.verdicts, config_with(kVisits).map, {});
  again.optimise();
  ASSERT_EQ(again.map().nodes.size(), before.nodes.size());
  for (std::size_t i = 0; i < before.nodes.size(); ++i)
    EXPECT_EQ(again.map().nodes[i].T_world_body, before.nodes[i].T_world_body);
  for (const Submap& submap : round_of(3))  // its robot sends all again
    EXPECT_TRUE(again.receive(SubmapMessage{{submap.id.chain.robot, submap.id.chain.session, 0}, submap}));
}

TEST(KnownGround, WhatLeadsToNewGroundStays) {
  Fleet fleet(0);
  for (std::uint32_t turn = 0; turn < 4; ++turn) fleet.drive(turn);
  const MapServerState& state = fleet.server().state();
  const auto latest = round_of(3);
  const SubmapId elsewhere = latest[4].id;
  std::set<SubmapPair> accepted = accepted_pairs(fleet.server().map(), state.verdicts);
  ASSERT_FALSE(accepted.empty());
  const auto config = config_with(kVisits).map.known_ground;
  const auto all =
      known_submaps(fleet.server().map(), state.submaps, accepted, {}, config, [](SubmapId) { return true; });
  ASSERT_EQ(std::ranges::count(all, elsewhere), 1);
  std::erase_if(accepted, [&](const SubmapPair& pair) { return pair.first == elsewhere || pair.second == elsewhere; });
  const auto known =
      known_submaps(fleet.server().map(), state.submaps, accepted, {}, config, [](SubmapId) { return true; });
  for (const std::uint32_t index : {3U, 4U, 5U})
    EXPECT_EQ(std::ranges::count(known, SubmapId{elsewhere.chain, index}), 0) << index;
  const auto waits = known_submaps(fleet.server().map(), state.submaps, accepted, {}, config,
                                   [&](SubmapId id) { return id.chain != elsewhere.chain; });
  EXPECT_TRUE(std::ranges::none_of(waits, [&](SubmapId id) { return id.chain == elsewhere.chain; }))
      << "nothing is retired before all its pairs have verdicts";
}

TEST(KnownGround, WhatIsRetiredLeavesTheMapWithItsSession) {
  SubmapSet submaps;
  std::set<SubmapId> retired, hidden;
  for (const std::uint32_t robot : {0U, 1U})
    for (const std::uint64_t session : {1U, 2U})
      for (std::uint32_t index = 0; index < 5; ++index) {
        const SubmapId id{{RobotId{robot}, session}, index};
        submaps.emplace(id, std::make_shared<const Submap>());
        if (index != 3) retired.insert(id);
        if (index != 3 && session == 1) hidden.insert(id);
      }
  for (std::uint32_t index = 5; index < 20; ++index) {  // a session that led to new ground
    const SubmapId id{{RobotId{2}, 1}, index};
    submaps.emplace(id, std::make_shared<const Submap>());
    if (index < 15) retired.insert(id);
    if (index < 15 - kAnchors) hidden.insert(id);
  }
  submaps.emplace(SubmapId{{RobotId{2}, 2}, 0}, std::make_shared<const Submap>());
  for (const std::uint32_t robot : {0U, 1U})
    for (const std::uint32_t index : {0U, 1U, 2U}) hidden.erase({{RobotId{robot}, 1}, index});  // all before 3
  EXPECT_EQ(hidden_of(submaps, retired), hidden);

  VerdictSet verdicts;
  std::set<SubmapPair> accepted;
  for (const SubmapId& id : retired)
    for (std::uint32_t index = 0; index < 9; ++index) {
      const SubmapPair pair = ordered(id, {{RobotId{7}, 1}, index});
      verdicts[pair] = {};
      if (index > 0) accepted.insert(pair);
    }
  std::map<SubmapId, std::size_t> left;
  const std::vector<SubmapId> chosen(retired.begin(), retired.end());
  const std::set<SubmapPair> gone = superfluous(verdicts, accepted, submaps, retired, chosen);
  for (const auto& [pair, verdict] : verdicts)
    if (!gone.contains(pair)) {
      ++left[pair.first];
      EXPECT_TRUE(accepted.contains(pair));
    }
  EXPECT_EQ(left.size(), retired.size() - hidden.size());
  for (const auto& [id, ties] : left) EXPECT_EQ(ties, kTies) << to_string(id);
}

}  // namespace known_ground_test
}  // namespace tutti::server
