// SPDX-License-Identifier: BSD-3-Clause
// Which pairs a server has verified where its verifier describes the appearance of places.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "support/server/world.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::server {
namespace places_test {

const std::set<RobotId> kRobots{RobotId{0}, RobotId{1}, RobotId{2}};

class Places : public testing::Test {
 protected:
  Places() {
    for (const RobotId robot : kRobots)
      for (Submap& submap : test::make_submaps(robot, {.keyframes = 181}, Rng(1).fork(robot.value)))
        uploads_.push_back({.header = {.robot = robot}, .submap = std::move(submap)});
  }
  [[nodiscard]] static ServerConfig with(int candidates) {
    ServerConfig config;
    config.candidates_per_submap = candidates;
    return config;
  }
  [[nodiscard]] MapServer server(int candidates, MapServerState state = {}) const {
    return {kRobots, verifier_, std::make_shared<MemoryPayloadStore>(), with(candidates), 1, std::move(state)};
  }
  std::size_t answer(MapServer& server) const {
    const auto jobs = server.take_jobs();
    for (const VerificationJob& job : jobs)
      EXPECT_TRUE(server.receive(*verifier_->verify(*job.first, *job.second, server.payloads())).has_value());
    return jobs.size();
  }
  /// All submaps, in the order of these numbers; jobs are answered at once or all at the end.
  [[nodiscard]] MapServer filled(int candidates, const std::vector<std::size_t>& order, bool at_once = true) const {
    MapServer out = server(candidates);
    for (const std::size_t i : order) {
      EXPECT_TRUE(out.receive(uploads_[i]).has_value());
      if (at_once) answer(out);
    }
    answer(out);
    return out;
  }
  [[nodiscard]] std::vector<std::size_t> in_order() const {
    std::vector<std::size_t> out(uploads_.size());
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = i;
    return out;
  }
  static std::vector<Pose3> poses(const MapServer& server) { return server.map().graph.poses; }

  std::vector<SubmapMessage> uploads_;
  std::shared_ptr<const ClosureVerifier> verifier_ =
      std::make_shared<test::RankingVerifier>(std::make_shared<test::TestVerifier>(1));
};

TEST_F(Places, AreComparedAndOnlyTheMostAlikeVerified) {
  MapServer all = filled(0, in_order());
  MapServer few = filled(4, in_order());
  EXPECT_EQ(all.work().places_compared, 0U);
  EXPECT_GT(few.work().places_compared, 0U);
  EXPECT_LT(few.work().pairs_verified, all.work().pairs_verified);
  EXPECT_EQ(few.state().places.size(), uploads_.size());
  all.optimise();
  few.optimise();
  EXPECT_EQ(few.map().components, 1U);
  EXPECT_LT(few.map().closures.size(), all.map().closures.size());
  // With so few candidates each, the work grows with the submaps, not with their square.
  EXPECT_LE(few.map().closures.size(), 4 * uploads_.size());
  const MapServer plenty = filled(1000, in_order());
  EXPECT_EQ(plenty.work().pairs_verified, all.work().pairs_verified);
}

TEST_F(Places, TheMapIsAFunctionOfTheSetOfSubmaps) {
  MapServer first = filled(4, in_order());
  first.optimise();
  for (std::uint64_t trial = 0; trial < 8; ++trial) {
    std::vector<std::size_t> order = in_order();
    Rng rng(trial);
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[rng.index(i)]);
    MapServer again = filled(4, order, trial % 2 == 0);
    again.optimise();
    ASSERT_EQ(again.map().closures.size(), first.map().closures.size());
    for (std::size_t c = 0; c < first.map().closures.size(); ++c)
      EXPECT_EQ(again.map().closures[c].closure, first.map().closures[c].closure);
    EXPECT_EQ(poses(again), poses(first));
  }
}

TEST_F(Places, AServerGoesOnWithWhatWasCompared) {
  MapServer whole = server(4), stopped = server(4);
  const std::size_t half = uploads_.size() / 2;
  for (std::size_t i = 0; i < half; ++i)
    for (MapServer* one : {&whole, &stopped}) ASSERT_TRUE(one->receive(uploads_[i]).has_value());
  answer(whole);
  stopped.take_jobs();  // killed before any was answered
  MapServer again = server(4, stopped.state());
  EXPECT_EQ(again.work().places_compared, 0U);
  EXPECT_TRUE(again.take_places().empty());
  answer(again);
  MapServer idle = server(4, again.state());
  EXPECT_EQ(answer(idle), 0U);  // nothing is asked twice
  for (std::size_t i = half; i < uploads_.size(); ++i)
    for (MapServer* one : {&whole, &again}) {
      ASSERT_TRUE(one->receive(uploads_[i]).has_value());
      EXPECT_EQ(one->take_places().back(), uploads_[i].submap.id);
      answer(*one);
    }
  whole.optimise();
  again.optimise();
  EXPECT_EQ(poses(again), poses(whole));
}

TEST_F(Places, ThoseOfAMapThatWasMergedAreComparedAtTheStart) {
  MapServer whole = filled(4, in_order());
  MapServerState state = whole.state();
  for (auto& [id, place] : state.places)
    if (id.chain.robot != RobotId{0}) place = {.looks = place.looks, .candidates = {}};
  MapServer merged = server(4, state);
  EXPECT_GT(merged.work().places_compared, 0U);
  EXPECT_EQ(merged.take_places().size(), 2 * uploads_.size() / 3);
  EXPECT_EQ(answer(merged), 0U);  // all were answered before
  whole.optimise();
  merged.optimise();
  EXPECT_EQ(poses(merged), poses(whole));
}

TEST_F(Places, OfAnotherVersionAreUnknown) {
  MapServer whole = filled(4, in_order());
  MapServerState state = whole.state();
  state.places.begin()->second.looks = "of_another_version";
  const SubmapId unknown = state.places.begin()->first;
  MapServer again = server(4, state);
  EXPECT_FALSE(again.state().places.contains(unknown));
  EXPECT_EQ(again.take_places(), std::vector{unknown});
  EXPECT_EQ(again.state().places.size(), uploads_.size() - 1);
  EXPECT_TRUE(server(0, state).state().places.empty());
}

TEST_F(Places, WhatAnOperatorAcceptedStaysInTheMap) {
  MapServer all = filled(0, in_order());
  MapServer few = server(1);
  for (const SubmapMessage& upload : uploads_) ASSERT_TRUE(few.receive(upload).has_value());
  std::set<SubmapPair> asked;
  for (const VerificationJob& job : few.take_jobs()) asked.insert(job.pair);
  const auto left =
      std::ranges::find_if(all.state().verdicts, [&](const auto& entry) { return !asked.contains(entry.first); });
  ASSERT_NE(left, all.state().verdicts.end());
  const auto is_there = [&] {
    few.optimise();
    return std::ranges::any_of(few.map().closures, [&](const JudgedClosure& judged) {
      return judged.closure == left->second.closures.front();
    });
  };
  ASSERT_TRUE(few.receive(left->second).has_value());  // somebody had asked before
  EXPECT_FALSE(is_there());
  ASSERT_TRUE(
      few.receive(left->first, ClosureDecision{.wish = Wish::accept, .by_hand = left->second.closures}).has_value());
  EXPECT_TRUE(is_there());
}

}  // namespace places_test
}  // namespace tutti::server
