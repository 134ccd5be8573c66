// SPDX-License-Identifier: BSD-3-Clause
// How MapServer uses verdicts: which it believes, in which order, and what it keeps of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "support/server/world.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::server {
namespace verdicts_test {

using test::TestVerifier;

const std::set<RobotId> kRobots{RobotId{0}, RobotId{1}};

SubmapMessage message_of(const Submap& submap) {
  return {.header = {.robot = submap.id.chain.robot}, .submap = submap};
}

/// Wants all pairs that are not neighbours and refuses them.
class Refuser final : public ClosureVerifier {
 public:
  explicit Refuser(std::uint32_t version = 1) : version_(version) {}
  [[nodiscard]] MethodId id() const override { return {"refuser", version_, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    return first.id.chain != second.id.chain || second.id.index - first.id.index > 1;
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const PayloadStore&) const override {
    return ClosureVerdict{{first.id, second.id}, {}, Refusal{RefusalReason::overlap, 0.1, 0.3}, id()};
  }

 private:
  std::uint32_t version_;
};

MapServer make_server(std::shared_ptr<const ClosureVerifier> verifier, MapServerState state = {}) {
  return {kRobots, std::move(verifier), std::make_shared<MemoryPayloadStore>(), {}, 1, std::move(state)};
}

/// Two keyframes a submap, the second that of the next one.
Submap small_submap(RobotId robot, std::uint32_t index) {
  Submap submap{.id = {robot, index}};
  submap.keyframes = {{index, {1'000'000'000LL * (index + 1)}, {}, true},
                      {index + 1, {1'000'000'000LL * (index + 2)}, {}, true}};
  submap.odometry = {RelativePose{}};
  return submap;
}

void send_small_submaps(MapServer& server, std::uint32_t from, std::uint32_t until) {
  for (std::uint32_t i = from; i < until; ++i)
    for (const RobotId robot : kRobots) ASSERT_TRUE(server.receive(message_of(small_submap(robot, i))).has_value());
}

ClosureVerdict answer(const ClosureVerifier& verifier, const VerificationJob& job) {
  return *verifier.verify(*job.first, *job.second, MemoryPayloadStore());
}

std::set<SubmapPair> pairs_of(const std::vector<VerificationJob>& jobs) {
  std::set<SubmapPair> pairs;
  for (const VerificationJob& job : jobs) pairs.insert(job.pair);
  return pairs;
}

std::size_t total(const RefusalCounts& counts) {
  std::size_t sum = 0;
  for (const auto& [reason, count] : counts) sum += count.intra + count.inter;
  return sum;
}

template <class T>
void shuffle(std::vector<T>& list, Rng& rng) {
  for (std::size_t i = list.size(); i > 1; --i) std::swap(list[i - 1], list[rng.index(i)]);
}

class Verdicts : public testing::Test {
 protected:
  Verdicts() {
    for (const RobotId robot : kRobots)
      for (const Submap& submap : test::make_submaps(robot, {}, Rng(1).fork(robot.value))) submaps_.push_back(submap);
    for (const Submap& submap : submaps_) EXPECT_TRUE(server_.receive(message_of(submap)).has_value());
    jobs_ = server_.take_jobs();
    good_ = answer(*verifier_, jobs_.front());
  }
  std::shared_ptr<const TestVerifier> verifier_ = std::make_shared<const TestVerifier>(1);
  MapServer server_ = make_server(verifier_);
  std::vector<Submap> submaps_;
  std::vector<VerificationJob> jobs_;
  ClosureVerdict good_;
};

TEST_F(Verdicts, ThatDoNotBelongToTheirPairAreErrorsAndChangeNothing) {
  server_.optimise();
  const auto refused = [&](const char* expected, auto corrupt) {
    ClosureVerdict bad = good_;
    corrupt(bad);
    const Status status = server_.receive(bad);
    ASSERT_FALSE(status.has_value()) << expected;
    EXPECT_NE(status.error().message.find(expected), std::string::npos) << status.error().message;
    EXPECT_FALSE(server_.has_news());
    EXPECT_TRUE(server_.state().verdicts.empty());
  };
  using V = ClosureVerdict;
  refused("first to be the smaller", [](V& v) { std::swap(v.pair.first, v.pair.second); });
  refused("first to be the smaller", [](V& v) { v.pair.second = v.pair.first; });
  refused("robot 7", [](V& v) { v.pair.second.chain.robot = v.closures[0].to.chain.robot = RobotId{7}; });
  refused("from robot", [](V& v) { v.closures[0].from.chain.robot = RobotId{7}; });
  refused("to robot", [](V& v) { v.closures[0].to.chain.robot = RobotId{7}; });
  refused("keyframe 4711", [](V& v) { v.closures[0].from.index = 4711; });
  refused("expected one of", [&](V& v) { v.closures[0].to.index = jobs_.front().second->keyframes.back().index + 1; });
  refused("no pose", [](V& v) { v.closures[0].measurement.T_a_b.translation.x() = std::nan(""); });
  refused("negative variance", [](V& v) { v.closures[0].measurement.covariance(3, 3) = -1.0; });
  refused("not asked", [](V& v) { v = {{{RobotId{0}, 3}, {RobotId{0}, 4}}, {}, Refusal{}, v.verifier}; });
  refused("1 closures and a refusal", [](V& v) { v.refusal.emplace(); });
  refused("0 closures without", [](V& v) { v.closures.clear(); });
  ASSERT_TRUE(server_.receive(good_).has_value());
  EXPECT_TRUE(server_.has_news());

  MapServer restored = make_server(verifier_, server_.state());
  EXPECT_EQ(restored.take_jobs().size(), jobs_.size() - 1);  // the bad ones answered nothing
}

TEST_F(Verdicts, OfOneVerifierTheSameHoldsWhateverComesFirst) {
  ClosureVerdict other = good_;
  other.closures[0].measurement.T_a_b.translation.z() += 0.01;
  ClosureVerdict more = other;  // of a verifier that knows closures one after the other
  more.closures.push_back(good_.closures[0]);
  const ClosureVerdict no{good_.pair, {}, Refusal{RefusalReason::misfit, 1.5, 1.2}, verifier_->id()};
  // The last one counts, however they are shuffled: more, then the one with smaller numbers, and in doubt none.
  for (const std::vector<ClosureVerdict>& all :
       {std::vector{other, good_}, {other, good_, more}, {good_, other, more, no}, {good_, no}}) {
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
      Rng rng(seed);
      std::vector<ClosureVerdict> order = all;
      order.push_back(order[rng.index(order.size())]);  // one of them twice
      shuffle(order, rng);
      MapServer server = make_server(verifier_);
      for (const Submap& submap : submaps_) ASSERT_TRUE(server.receive(message_of(submap)).has_value());
      for (const ClosureVerdict& verdict : order) ASSERT_TRUE(server.receive(verdict).has_value());
      std::vector<LoopClosure> kept;
      for (const auto& [pair, verdict] : server.state().verdicts)
        kept.insert(kept.end(), verdict.closures.begin(), verdict.closures.end());
      EXPECT_EQ(kept, all.back().closures) << all.size() << " verdicts, seed " << seed;
      MapServer restored = make_server(verifier_, server.state());
      EXPECT_FALSE(pairs_of(restored.take_jobs()).contains(good_.pair));
    }
  }
}

TEST_F(Verdicts, OfAnotherVerifierAreNotBelieved) {
  const MethodId mine = verifier_->id();
  for (const MethodId& other : {MethodId{"test", 2, 0}, MethodId{"test", 1, 7}, MethodId{"other", 1, 0}, MethodId{}}) {
    ClosureVerdict verdict = good_;
    verdict.verifier = other;
    const Status status = server_.receive(verdict);
    ASSERT_FALSE(status.has_value());
    EXPECT_EQ(status.error().code, ErrorCode::unsupported);
    EXPECT_NE(status.error().message.find(to_string(other)), std::string::npos) << status.error().message;
    EXPECT_NE(status.error().message.find(to_string(mine)), std::string::npos) << status.error().message;
  }
  EXPECT_TRUE(server_.state().verdicts.empty());
  EXPECT_EQ(pairs_of(make_server(verifier_, server_.state()).take_jobs()), pairs_of(jobs_));
}

TEST_F(Verdicts, ThatOvertakeTheirSubmapsWaitForThem) {
  MapServer in_order = make_server(verifier_);
  for (const Submap& submap : submaps_) ASSERT_TRUE(in_order.receive(message_of(submap)).has_value());
  for (const VerificationJob& job : jobs_) ASSERT_TRUE(in_order.receive(answer(*verifier_, job)).has_value());

  MapServer overtaken = make_server(verifier_);
  ClosureVerdict bad = answer(*verifier_, jobs_.back());
  bad.closures[0].from.index = 4711;
  for (const VerificationJob& job : jobs_)
    ASSERT_TRUE(overtaken.receive(job.pair == bad.pair ? bad : answer(*verifier_, job)).has_value());
  EXPECT_TRUE(overtaken.state().verdicts.empty());
  for (const Submap& submap : submaps_) ASSERT_TRUE(overtaken.receive(message_of(submap)).has_value());
  const std::vector<Error> errors = overtaken.take_late_errors();
  ASSERT_EQ(errors.size(), 1U);
  EXPECT_NE(errors.front().message.find("keyframe 4711"), std::string::npos) << errors.front().message;
  const auto asked_again = overtaken.take_jobs();
  ASSERT_EQ(pairs_of(asked_again), std::set{bad.pair});
  ASSERT_TRUE(overtaken.receive(answer(*verifier_, asked_again.front())).has_value());
  EXPECT_EQ(overtaken.state().verdicts, in_order.state().verdicts);
  EXPECT_EQ(overtaken.optimise().graph, in_order.optimise().graph);
}

TEST_F(Verdicts, NoMoreThanSoManyWait) {
  ClosureVerdict early{{{RobotId{0}, 0}, {RobotId{1}, 10'000}}, {}, Refusal{}, verifier_->id()};
  for (std::size_t i = 0; i < MapServer::kMostWaiting; ++i, ++early.pair.second.index) {
    ASSERT_TRUE(server_.receive(early).has_value());
    ASSERT_TRUE(server_.receive(early).has_value());  // does not wait twice
  }
  const Status status = server_.receive(early);
  ASSERT_FALSE(status.has_value());
  EXPECT_NE(status.error().message.find("1000 verdicts wait"), std::string::npos) << status.error().message;
  EXPECT_TRUE(server_.receive(good_).has_value());  // whose submaps are there
}

TEST(VerdictState, ARestoredServerAsksExactlyWhatWasNotAnswered) {
  const auto verifier = std::make_shared<const Refuser>();
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Rng rng(seed);
    MapServer server = make_server(verifier);
    std::vector<VerificationJob> open;
    for (std::uint32_t i = 0; i < 12; ++i) {
      send_small_submaps(server, i, i + 1);
      std::ranges::move(server.take_jobs(), std::back_inserter(open));
      shuffle(open, rng);
      const std::size_t left = rng.index(open.size() + 1);
      for (; open.size() > left; open.pop_back())
        ASSERT_TRUE(server.receive(answer(*verifier, open.back())).has_value());
    }
    MapServer restored = make_server(verifier, server.state());
    EXPECT_EQ(pairs_of(restored.take_jobs()), pairs_of(open));
    EXPECT_EQ(restored.refusals(), server.refusals());
    const std::size_t pairs = 24 * 23 / 2 - 2 * 11;
    EXPECT_EQ(total(restored.refusals()), pairs - open.size());
  }
}

TEST(VerdictState, AnHoursRefusalsAreAFewNumbersPerSubmap) {
  const auto verifier = std::make_shared<const Refuser>();
  MapServer server = make_server(verifier);
  std::size_t answered = 0;
  for (std::uint32_t i = 0; i < 350; ++i) {
    send_small_submaps(server, i, i + 1);
    for (const VerificationJob& job : server.take_jobs()) {
      ASSERT_TRUE(server.receive(answer(*verifier, job)).has_value());
      ++answered;
    }
  }
  EXPECT_EQ(answered, 700U * 699U / 2U - 2U * 349U);  // 243,952
  const MapServerState& state = server.state();
  EXPECT_EQ(state.verdicts.size(), 0U);
  EXPECT_EQ(state.answered.intervals_beyond(), 0U);
  EXPECT_EQ(state.answered.watermark({RobotId{1}, 349}), 699U);
  EXPECT_EQ(state.refused.at(RefusalReason::overlap).intra, 2U * (350U * 349U / 2U - 349U));
  EXPECT_EQ(total(server.refusals()), answered);
  EXPECT_TRUE(make_server(verifier, state).take_jobs().empty());
}

TEST_F(Verdicts, AnotherVerifierAsksAgainAndReplacesWhatTheFormerFound) {
  const ClosureVerdict once_refused{jobs_[1].pair, {}, Refusal{RefusalReason::misfit, 1.5, 1.2}, verifier_->id()};
  ASSERT_TRUE(server_.receive(once_refused).has_value());
  for (const VerificationJob& job : jobs_) ASSERT_TRUE(server_.receive(answer(*verifier_, job)).has_value());
  EXPECT_EQ(total(server_.refusals()), 1U);
  const auto other = std::make_shared<const TestVerifier>(2, 0, 2);
  MapServer restored = make_server(other, server_.state());
  EXPECT_EQ(restored.state().verdicts, server_.state().verdicts);  // the map stays as it was
  EXPECT_TRUE(restored.refusals().empty());
  auto again = restored.take_jobs();
  EXPECT_EQ(pairs_of(again), pairs_of(jobs_));
  for (const VerificationJob& job : jobs_) EXPECT_FALSE(restored.receive(answer(*verifier_, job)).has_value());  // late
  for (std::size_t i = 1; i < again.size(); ++i) ASSERT_TRUE(restored.receive(answer(*other, again[i])).has_value());
  MapServer twice = make_server(other, restored.state());
  EXPECT_EQ(pairs_of(twice.take_jobs()), std::set{again[0].pair});
  EXPECT_EQ(twice.state().verdicts.at(again[0].pair).verifier, verifier_->id());
  const ClosureVerdict refusal{again[0].pair, {}, Refusal{RefusalReason::no_alignment}, other->id()};
  ASSERT_TRUE(twice.receive(refusal).has_value());
  EXPECT_FALSE(twice.state().verdicts.contains(again[0].pair));
  for (const auto& [pair, verdict] : twice.state().verdicts) EXPECT_EQ(verdict.verifier, other->id());
  EXPECT_EQ(total(twice.refusals()), 1U);

  MapServer back = make_server(verifier_, twice.state());  // none is better than the other
  EXPECT_EQ(back.state().verdicts, twice.state().verdicts);
  EXPECT_EQ(pairs_of(back.take_jobs()), pairs_of(jobs_));
}

/// Sees nothing in any submap.
class Blind final : public ClosureVerifier {
 public:
  [[nodiscard]] MethodId id() const override { return {"blind", 9, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return false; }
  [[nodiscard]] bool is_candidate(const Submap&, const Submap&) const override { return true; }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap&, const Submap&, const PayloadStore&) const override {
    return fail(ErrorCode::invalid, "was not to be asked");
  }
};

TEST_F(Verdicts, AVerifierThatHasNothingToCompareErasesNoClosure) {
  for (const VerificationJob& job : jobs_) ASSERT_TRUE(server_.receive(answer(*verifier_, job)).has_value());
  ASSERT_GT(server_.state().verdicts.size(), 5U);
  server_.optimise();
  MapServer blind = make_server(std::make_shared<const Blind>(), server_.state());
  EXPECT_TRUE(blind.take_jobs().empty());
  EXPECT_EQ(blind.state().verdicts, server_.state().verdicts);
  blind.optimise();
  EXPECT_EQ(blind.map().closures.size(), server_.map().closures.size());
  MapServer back = make_server(verifier_, blind.state());
  EXPECT_TRUE(back.take_jobs().empty());  // they are its own
  EXPECT_EQ(back.state().verdicts, server_.state().verdicts);
}

}  // namespace verdicts_test
}  // namespace tutti::server
