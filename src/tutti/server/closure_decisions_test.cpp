// SPDX-License-Identifier: BSD-3-Clause
// An operator's decision on closures stands above what the server finds.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

#include "support/server/world.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::server {
namespace closure_decisions_test {

using test::TestVerifier;

struct Inputs {
  SubmapSet submaps;
  VerdictSet verdicts;
};

Inputs make_inputs(const TestVerifier& verifier, std::uint64_t seed) {
  Inputs in;
  for (std::uint32_t r = 0; r < 2; ++r)
    for (Submap& submap : test::make_submaps(RobotId{r}, {}, Rng(seed).fork(r)))
      in.submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  for (auto a = in.submaps.begin(); a != in.submaps.end(); ++a)
    for (auto b = std::next(a); b != in.submaps.end(); ++b)
      if (verifier.is_candidate(*a->second, *b->second))
        in.verdicts[{a->first, b->first}] = *verifier.verify(*a->second, *b->second, MemoryPayloadStore());
  return in;
}

ClosureDecision decision(Wish wish, std::int64_t given_ns = 1) { return {"a/1-b/2", wish, "ada", given_ns}; }

const JudgedClosure& judged(const MapEstimate& map, const LoopClosure& closure) {
  return *std::ranges::find_if(map.closures, [&](const JudgedClosure& j) {
    return j.closure.from == closure.from && j.closure.to == closure.to;
  });
}

/// The edge of a closure in the map, if it is there.
std::optional<PoseGraphEdge> edge_of(const MapEstimate& map, const LoopClosure& closure) {
  for (std::size_t e = map.odometry_edges; e < map.graph.edges.size(); ++e) {
    const PoseGraphEdge& edge = map.graph.edges[e];
    if (map.nodes[edge.from].id == closure.from && map.nodes[edge.to].id == closure.to) return edge;
  }
  return std::nullopt;
}

std::size_t accepted(const MapEstimate& map) {
  return static_cast<std::size_t>(std::ranges::count_if(map.closures, &JudgedClosure::accepted));
}

TEST(ClosureDecisions, ARejectedClosureIsAsIfItHadNotBeenFound) {
  const Inputs in = make_inputs(TestVerifier(2), 2);
  const MapEstimate plain = estimate_map(in.submaps, in.verdicts, {});
  for (const auto& [pair, verdict] : in.verdicts) {
    const LoopClosure& closure = verdict.closures.front();
    if (!judged(plain, closure).accepted || pair.first.index % 3 != 0) continue;
    VerdictSet without = in.verdicts;
    without.erase(pair);
    const MapEstimate expected = estimate_map(in.submaps, without, {});
    const MapEstimate map = estimate_map(in.submaps, in.verdicts, {}, {{pair, decision(Wish::reject)}});
    EXPECT_EQ(map.graph.poses, expected.graph.poses);
    EXPECT_EQ(map.graph.edges.size(), expected.graph.edges.size());
    EXPECT_EQ(map.closures.size(), plain.closures.size());
    EXPECT_FALSE(judged(map, closure).accepted);
    EXPECT_TRUE(judged(map, closure).by_operator);
    EXPECT_EQ(judged(map, closure).objection, judge::Objection::operators);
    const MapEstimate again = estimate_map(in.submaps, in.verdicts, {}, {{pair, decision(Wish::withdraw)}});
    EXPECT_EQ(again.graph.poses, plain.graph.poses);
    EXPECT_FALSE(judged(again, closure).by_operator);
  }
}

TEST(ClosureDecisions, AnAcceptedClosureIsInTheMapWhateverItContradicts) {
  std::size_t wrong = 0;
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Inputs in = make_inputs(TestVerifier(seed, 4), seed);
    const MapEstimate plain = estimate_map(in.submaps, in.verdicts, {});
    for (const auto& [pair, verdict] : in.verdicts) {
      const LoopClosure& closure = verdict.closures.front();
      if (!TestVerifier::is_wrong(closure)) continue;
      ++wrong;
      EXPECT_FALSE(judged(plain, closure).accepted);
      EXPECT_NE(judged(plain, closure).objection, judge::Objection::none);
      EXPECT_STRNE(to_string(judged(plain, closure).objection), "");
      const MapEstimate map = estimate_map(in.submaps, in.verdicts, {}, {{pair, decision(Wish::accept)}});
      EXPECT_TRUE(map.converged);
      EXPECT_TRUE(judged(map, closure).accepted && judged(map, closure).by_operator);
      EXPECT_EQ(judged(map, closure).objection, judge::Objection::none);
      EXPECT_TRUE(edge_of(map, closure).has_value());
    }
  }
  EXPECT_GT(wrong, 5U);
}

TEST(ClosureDecisions, AnAcceptedClosureKeepsItsCovarianceAndNothingElseOfTheMapChanges) {
  const Inputs in = make_inputs(TestVerifier(4), 4);
  const MapEstimate plain = estimate_map(in.submaps, in.verdicts, {});
  DecisionSet decisions;
  for (const auto& [pair, verdict] : in.verdicts) decisions[pair] = decision(Wish::accept);
  const MapEstimate map = estimate_map(in.submaps, in.verdicts, {}, decisions);
  EXPECT_EQ(accepted(map), map.closures.size());
  std::size_t compared = 0;
  for (const JudgedClosure& closure : plain.closures) {
    const auto before = edge_of(plain, closure.closure), after = edge_of(map, closure.closure);
    ASSERT_TRUE(after.has_value());
    if (!before) continue;
    ++compared;
    EXPECT_EQ(before->information, after->information);
  }
  EXPECT_GT(compared, 5U);
  for (std::size_t i = 0; i < plain.nodes.size(); ++i)
    EXPECT_LT(local(plain.nodes[i].T_world_body, map.nodes[i].T_world_body).norm(), 0.05) << i;
}

TEST(ClosureDecisions, OneAcceptedClosureJoinsTwoRobots) {
  const Inputs in = make_inputs(TestVerifier(3), 3);
  const auto inter = std::ranges::find_if(
      in.verdicts, [](const auto& entry) { return entry.first.first.chain != entry.first.second.chain; });
  const VerdictSet one{*inter};
  const MapEstimate apart = estimate_map(in.submaps, one, {});
  EXPECT_EQ(apart.components, 2U);
  EXPECT_EQ(apart.closures.front().objection, judge::Objection::too_few);
  EXPECT_EQ(estimate_map(in.submaps, one, {}, {{inter->first, decision(Wish::accept)}}).components, 1U);
}

TEST(ClosureDecisions, AClosureAddedByHandJoinsTwoRobotsAndIsGoneWhenItIsWithdrawn) {
  const Inputs in = make_inputs(TestVerifier(3), 3);
  const auto inter = std::ranges::find_if(
      in.verdicts, [](const auto& entry) { return entry.first.first.chain != entry.first.second.chain; });
  ClosureDecision added = decision(Wish::accept);
  added.by_hand = inter->second.closures;
  const MapEstimate joined = estimate_map(in.submaps, {}, {}, {{inter->first, added}});
  EXPECT_EQ(joined.components, 1U);
  ASSERT_EQ(joined.closures.size(), 1U);
  EXPECT_TRUE(joined.closures.front().accepted && joined.closures.front().by_operator);
  EXPECT_EQ(joined.graph.poses,
            estimate_map(in.submaps, VerdictSet{*inter}, {}, {{inter->first, decision(Wish::accept)}}).graph.poses)
      << "as one that was found";
  for (const Wish wish : {Wish::reject, Wish::withdraw}) {
    added.wish = wish;
    EXPECT_EQ(estimate_map(in.submaps, {}, {}, {{inter->first, added}}).components, 2U);
  }
}

/// A server that knows all submaps, and the verifier's verdicts on all pairs it asks for.
class DecisionsToAServer : public testing::Test {
 protected:
  DecisionsToAServer() : server_(make(verifier_)) {
    for (const auto& [id, submap] : make_inputs(TestVerifier(5, 4), 5).submaps)
      EXPECT_TRUE(server_.receive(SubmapMessage{{id.chain.robot, id.chain.session, id.index}, *submap}).has_value());
    answer(server_, *verifier_);
    server_.optimise();
    for (const JudgedClosure& closure : server_.map().closures)
      if (closure.objection == judge::Objection::contradicted || closure.objection == judge::Objection::dear)
        refused_ = closure.closure;
    for (const auto& [pair, verdict] : server_.state().verdicts)
      if (verdict.closures.front() == refused_) pair_ = pair;
  }
  static MapServer make(std::shared_ptr<const ClosureVerifier> verifier, MapServerState state = {}) {
    return {{RobotId{0}, RobotId{1}}, std::move(verifier), std::make_shared<MemoryPayloadStore>(), {}, 1,
            std::move(state)};
  }
  static void answer(MapServer& server, const ClosureVerifier& verifier) {
    for (const VerificationJob& job : server.take_jobs())
      EXPECT_TRUE(server.receive(*verifier.verify(*job.first, *job.second, MemoryPayloadStore())).has_value());
  }
  /// Another one finds nothing anywhere.
  class Other final : public ClosureVerifier {
   public:
    [[nodiscard]] MethodId id() const override { return {"nothing", 1, 0}; }
    [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
    [[nodiscard]] bool is_candidate(const Submap&, const Submap&) const override { return true; }
    [[nodiscard]] Result<ClosureVerdict> verify(const Submap& a, const Submap& b, const PayloadStore&) const override {
      return ClosureVerdict{{a.id, b.id}, {}, Refusal{RefusalReason::overlap, 0.1, 0.3}, id()};
    }
  };

  std::shared_ptr<const TestVerifier> verifier_ = std::make_shared<TestVerifier>(5, 4);
  MapServer server_;
  LoopClosure refused_;
  SubmapPair pair_;
};

TEST_F(DecisionsToAServer, TheMapFollowsAtTheNextUpdate) {
  EXPECT_FALSE(server_.has_news());
  ASSERT_TRUE(server_.receive(pair_, decision(Wish::accept)).has_value());
  EXPECT_TRUE(server_.has_news());
  server_.optimise();
  EXPECT_TRUE(judged(server_.map(), refused_).accepted);
  ASSERT_TRUE(server_.receive(pair_, decision(Wish::accept)).has_value());  // again
  EXPECT_FALSE(server_.has_news());
  ASSERT_TRUE(server_.receive(pair_, decision(Wish::withdraw, 2)).has_value());
  EXPECT_TRUE(server_.has_news());
  server_.optimise();
  EXPECT_FALSE(judged(server_.map(), refused_).accepted);
}

TEST_F(DecisionsToAServer, TheLaterDecisionCountsInWhateverOrderTheyCome) {
  std::vector<ClosureDecision> decisions{decision(Wish::accept, 3), decision(Wish::reject, 2),
                                         decision(Wish::withdraw, 1)};
  std::ranges::sort(decisions, {}, &ClosureDecision::given_ns);
  do {
    MapServer server = make(verifier_, server_.state());
    for (const ClosureDecision& one : decisions) ASSERT_TRUE(server.receive(pair_, one).has_value());
    EXPECT_EQ(server.state().decisions.at(pair_), decision(Wish::accept, 3));
    server.optimise();
    EXPECT_TRUE(judged(server.map(), refused_).accepted);
  } while (std::ranges::next_permutation(decisions, {}, &ClosureDecision::given_ns).found);
}

TEST_F(DecisionsToAServer, WhatIsAcceptedStaysWhateverOtherVerifiersSay) {
  ASSERT_TRUE(server_.receive(pair_, decision(Wish::accept)).has_value());
  const auto other = std::make_shared<Other>();
  MapServer server = make(other, server_.state());
  const auto jobs = server.take_jobs();
  EXPECT_TRUE(std::ranges::none_of(jobs, [&](const VerificationJob& job) { return job.pair == pair_; }));
  for (const VerificationJob& job : jobs)
    ASSERT_TRUE(server.receive(*other->verify(*job.first, *job.second, MemoryPayloadStore())).has_value());
  const auto late = other->verify(*server.state().submaps.at(pair_.first), *server.state().submaps.at(pair_.second),
                                  MemoryPayloadStore());
  ASSERT_TRUE(server.receive(*late).has_value());
  server.optimise();
  ASSERT_EQ(server.map().closures.size(), 1U);
  EXPECT_TRUE(server.map().closures.front().accepted);
  EXPECT_EQ(server.map().closures.front().closure, refused_);

  ASSERT_TRUE(server.receive(pair_, decision(Wish::withdraw, 2)).has_value());
  const auto asked = server.take_jobs();  // which it was not, of this verifier
  ASSERT_EQ(asked.size(), 1U);
  EXPECT_EQ(asked.front().pair, pair_);
  answer(server, *other);
  ASSERT_TRUE(server.receive(*late).has_value());
  server.optimise();
  EXPECT_TRUE(server.map().closures.empty());
}

TEST_F(DecisionsToAServer, WhatCannotBeMeantIsRefused) {
  const MapServerState before = server_.state();
  const SubmapPair unknown{pair_.first, {RobotId{1}, 999}}, turned{pair_.second, pair_.first};
  const SubmapPair apart{{RobotId{0}, 0}, {RobotId{0}, 1}};  // neighbours are not asked for
  for (const SubmapPair& pair : {unknown, turned, apart})
    EXPECT_FALSE(server_.receive(pair, decision(Wish::accept)).has_value());
  EXPECT_EQ(server_.state().decisions, before.decisions);
  EXPECT_FALSE(server_.has_news());
  EXPECT_TRUE(server_.receive(apart, decision(Wish::reject)).has_value());  // should one ever be found
  EXPECT_FALSE(server_.has_news());
}

TEST_F(DecisionsToAServer, AClosureAddedByHandNeedsNoOtherAndIsBetweenKeyframesOfItsSubmaps) {
  const SubmapSet submaps = server_.state().submaps;
  const SubmapPair between{submaps.begin()->first, std::prev(submaps.end())->first};
  const std::uint32_t last = std::prev(submaps.end())->second->keyframes.back().index;
  ClosureDecision added = decision(Wish::accept, 10);
  added.by_hand.push_back({});
  added.by_hand.front().from.index = submaps.begin()->second->keyframes.front().index;
  added.by_hand.front().to.index = last;
  added.by_hand.front().measurement.covariance = Matrix6d::Identity();
  ASSERT_TRUE(server_.receive(between, added).has_value());
  EXPECT_TRUE(server_.has_news());
  EXPECT_EQ(server_.state().decisions.at(between).by_hand.front().to.chain, between.second.chain)
      << "sessions are those of the pair";
  added.given_ns = 11;
  added.by_hand.front().to.index = last + 1;
  const auto beyond = server_.receive(between, added);
  ASSERT_FALSE(beyond.has_value());
  EXPECT_NE(beyond.error().message.find("keyframes"), std::string::npos) << beyond.error().message;
}

}  // namespace closure_decisions_test
}  // namespace tutti::server
