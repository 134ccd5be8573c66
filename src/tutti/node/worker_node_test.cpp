// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/worker_node.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <thread>
#include <vector>

#include "support/node/submaps.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::node {
namespace worker_node_test {

const ChainId kAlpha{RobotId{0}, 7}, kBravo{RobotId{1}, 7};
const bus::Endpoint kWorker = bus::Endpoint::worker(0);

class WorkerNodeTest : public testing::Test {
 protected:
  /// Frames of the submaps below 4.
  static std::shared_ptr<SubmapFrames> frames() {
    return std::make_shared<SubmapFrames>([](SubmapId id) -> Result<std::string> {
      if (id.index >= 4) return fail(ErrorCode::io, "no submap {}", to_string(id));
      return wire::encode(test::submap(id.chain, id.index));
    });
  }
  static bus::Envelope envelope(const Job& job) {
    return {bus::Endpoint::server(), kWorker, bus::MessageKind::job, job.id,
            std::make_shared<const std::string>(wire::encode(job))};
  }
  static Verdicts answer(const Step& step) {
    EXPECT_EQ(step.messages.size(), 1U);
    EXPECT_TRUE(step.writes.empty());
    EXPECT_EQ(step.messages.at(0).to, bus::Endpoint::server());
    return wire::decode_verdicts(*step.messages.at(0).bytes).value();
  }
  std::shared_ptr<const server::ClosureVerifier> verifier_ = std::make_shared<test::EvenVerifier>();
};

TEST_F(WorkerNodeTest, AnswersEveryPairOfAJobTheSameOnAnyNumberOfThreads) {
  Job job{.id = "1/0", .pairs = {}, .verifier = test::EvenVerifier().id()};
  for (std::uint32_t i = 0; i < 5; ++i) job.pairs.push_back({{kAlpha, i}, {kBravo, 2}});
  WorkerNode alone(kWorker, verifier_, frames());
  const Verdicts verdicts = answer(alone.receive(envelope(job), Timestamp{}));
  EXPECT_EQ(verdicts.job, "1/0");
  ASSERT_EQ(verdicts.verdicts.size(), 4U);
  for (const ClosureVerdict& verdict : verdicts.verdicts)
    EXPECT_EQ(verdict.closures.size(), verdict.pair.first.index % 2 == 0 ? 1U : 0U);
  EXPECT_EQ(verdicts.failed, (std::vector<SubmapPair>{job.pairs[4]}));
  EXPECT_NE(verdicts.why.find("no submap"), std::string::npos) << verdicts.why;

  WorkerNode many(kWorker, verifier_, frames(), [](std::size_t count, const std::function<void(std::size_t)>& call) {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < count; ++i) threads.emplace_back(call, count - 1 - i);
  });
  EXPECT_EQ(answer(many.receive(envelope(job), Timestamp{})), verdicts);
  EXPECT_EQ(answer(many.receive(envelope(job), Timestamp{})), verdicts);  // again
}

TEST_F(WorkerNodeTest, AVerifierThatThrowsCostsThePairAndNothingElse) {
  class Throwing final : public server::ClosureVerifier {
   public:
    [[nodiscard]] MethodId id() const override { return there_.id(); }
    [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
      return there_.is_candidate(first, second);
    }
    [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
      return there_.can_compare(first, second);
    }
    [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                                const server::PayloadStore& payloads) const override {
      if (first.id.index == 1) throw std::out_of_range("vector::_M_range_check");
      return there_.verify(first, second, payloads);
    }

   private:
    test::EvenVerifier there_;
  };
  WorkerNode worker(kWorker, std::make_shared<Throwing>(), frames());
  Job job{.id = "1/0", .pairs = {}, .verifier = test::EvenVerifier().id()};
  for (std::uint32_t i = 0; i < 3; ++i) job.pairs.push_back({{kAlpha, i}, {kBravo, 2}});
  const Verdicts verdicts = answer(worker.receive(envelope(job), Timestamp{}));
  EXPECT_EQ(verdicts.verdicts.size(), 2U);
  EXPECT_EQ(verdicts.failed, (std::vector<SubmapPair>{job.pairs[1]}));
  EXPECT_NE(verdicts.why.find("_M_range_check"), std::string::npos) << verdicts.why;
}

/// Knows the closure of submap n 100 n seconds after the robots' clock began, and one more 1000 s later.
class LaterVerifier final : public server::ClosureVerifier {
 public:
  [[nodiscard]] MethodId id() const override { return there_.id(); }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    return there_.is_candidate(first, second);
  }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
    return there_.can_compare(first, second);
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override {
    auto verdict = there_.verify(first, second, payloads);
    if (verdict && !verdict->closures.empty()) verdict->closures.push_back(verdict->closures.front());
    return verdict;
  }
  [[nodiscard]] std::vector<Timestamp> known_at(const Submap& first, const Submap&) const override {
    return {Timestamp{} + 100.0 * first.id.index, Timestamp{} + (100.0 * first.id.index + 1000.0)};
  }

 private:
  test::EvenVerifier there_;
};

TEST_F(WorkerNodeTest, AnswersWithEachClosureWhenItIsKnownAndTheJobWithTheLast) {
  WorkerNode worker(kWorker, std::make_shared<LaterVerifier>(), frames());
  Job job{.id = "1/0", .pairs = {}, .verifier = test::EvenVerifier().id()};
  for (std::uint32_t i = 0; i < 3; ++i) job.pairs.push_back({{kAlpha, i}, {kBravo, 2}});
  const Timestamp newest = test::submap(kBravo, 2).submap.keyframes.back().stamp;
  const Timestamp now = newest + 5000.0;  // the clock here is 5000 s ahead
  const Step step = worker.receive(envelope(job), now);
  EXPECT_FALSE(worker.holds_job());
  ASSERT_EQ(step.messages.size(), 2U);  // the refusal, and what is known of submap 0
  std::vector<Verdicts> answers;
  for (const bus::Envelope& message : step.messages) answers.push_back(wire::decode_verdicts(*message.bytes).value());
  EXPECT_NE(answers[0].job, "1/0");
  EXPECT_NE(answers[1].job, "1/0");
  EXPECT_NE(step.messages[0].id, step.messages[1].id);
  ASSERT_EQ(answers[0].verdicts.size(), 1U);
  EXPECT_TRUE(answers[0].verdicts[0].refusal.has_value());
  ASSERT_EQ(answers[1].verdicts.size(), 1U);
  EXPECT_EQ(answers[1].verdicts[0].pair, job.pairs[0]);
  EXPECT_EQ(answers[1].verdicts[0].closures.size(), 1U);
  ASSERT_EQ(worker.next_timer(), Timestamp{} + 5200.0);
  EXPECT_EQ(answer(worker.on_timer(*worker.next_timer())).verdicts.at(0).pair, job.pairs[2]);
  EXPECT_EQ(answer(worker.on_timer(Timestamp{} + 6000.0)).verdicts.at(0).closures.size(), 2U);
  ASSERT_EQ(worker.next_timer(), Timestamp{} + 6200.0);
  const Verdicts last = answer(worker.on_timer(*worker.next_timer()));
  EXPECT_EQ(last.job, "1/0");
  EXPECT_EQ(last.verdicts.at(0).closures.size(), 2U);
  EXPECT_FALSE(worker.next_timer().has_value());
}

/// A worker's requests for submaps to the server, and the server's answers.
class DistantWorkerTest : public WorkerNodeTest {
 protected:
  static Job job_of(std::uint32_t count) {
    Job job{.id = "1/0", .pairs = {}, .verifier = test::EvenVerifier().id()};
    for (std::uint32_t i = 0; i < count; ++i) job.pairs.push_back({{kAlpha, i}, {kBravo, 2}});
    return job;
  }
  static std::vector<SubmapId> asked(const Step& step) {
    std::vector<SubmapId> ids;
    for (const bus::Envelope& message : step.messages)
      if (message.kind == bus::MessageKind::submap_request) {
        const SubmapRequest request = wire::decode_submap_request(*message.bytes).value();
        ids.insert(ids.end(), request.submaps.begin(), request.submaps.end());
      }
    return ids;
  }
  static bus::Envelope copy(SubmapId id, SubmapId inside) {
    const std::string frame = wire::encode(test::submap(inside.chain, inside.index));
    return {bus::Endpoint::server(),
            kWorker,
            bus::MessageKind::submap_copy,
            {},
            std::make_shared<const std::string>(wire::encode(SubmapCopy{id, frame}))};
  }
  std::shared_ptr<FrameCache> cache_ = std::make_shared<FrameCache>(1U << 20U);
  WorkerNode worker_{kWorker, verifier_, cache_};
};

TEST_F(DistantWorkerTest, AsksForWhatItLacksAndHoldsTheJobUntilItHasAll) {
  const Job job = job_of(3);
  std::vector<SubmapId> open = asked(worker_.receive(envelope(job), Timestamp{}));
  EXPECT_EQ(open.size(), 4U);
  while (open.size() > 1) {
    EXPECT_TRUE(worker_.receive(copy(open.back(), open.back()), Timestamp{}).messages.empty());
    EXPECT_TRUE(worker_.holds_job());
    open.pop_back();
  }
  const Step last = worker_.receive(copy(open[0], open[0]), Timestamp{});
  EXPECT_FALSE(worker_.holds_job());
  WorkerNode near(kWorker, verifier_, frames());
  EXPECT_EQ(answer(last), answer(near.receive(envelope(job), Timestamp{})));
  EXPECT_EQ(answer(worker_.receive(envelope(job), Timestamp{})), answer(last));  // it has them now
}

TEST_F(DistantWorkerTest, AJobOfSubmapsThatTheMapDoesNotHaveIsAnsweredAtOnce) {
  const Job job = job_of(2);
  const std::vector<SubmapId> open = asked(worker_.receive(envelope(job), Timestamp{}));
  bus::Envelope none = copy(open[0], open[0]);
  none.bytes = std::make_shared<const std::string>(wire::encode(SubmapCopy{open[0], ""}));
  const Verdicts failed = answer(worker_.receive(none, Timestamp{}));
  EXPECT_FALSE(worker_.holds_job());
  EXPECT_EQ(failed.failed, job.pairs);
  EXPECT_FALSE(failed.cannot);
  EXPECT_NE(failed.why.find("is not in the map"), std::string::npos) << failed.why;
  EXPECT_TRUE(worker_.receive(none, Timestamp{}).messages.empty());  // of no job
}

TEST_F(DistantWorkerTest, AsksAgainForWhatDoesNotComeAndAtLastAnswersWithout) {
  const Job job = job_of(2);
  const std::vector<SubmapId> open = asked(worker_.receive(envelope(job), Timestamp{}));
  ASSERT_EQ(open.size(), 3U);
  static_cast<void>(worker_.receive(copy({kBravo, 2}, {kBravo, 2}), Timestamp{} + 1.0));
  EXPECT_EQ(worker_.next_timer(), Timestamp{} + 2.0);
  EXPECT_EQ(asked(worker_.on_timer(Timestamp{} + 2.0)), (std::vector<SubmapId>{{kAlpha, 0}, {kAlpha, 1}}));
  EXPECT_TRUE(asked(worker_.on_timer(Timestamp{} + 3.0)).empty());
  static_cast<void>(worker_.receive(copy({kAlpha, 0}, {kAlpha, 0}), Timestamp{} + 4.0));
  const Verdicts without = answer(worker_.on_timer(Timestamp{} + 4.0 + WorkerNode::kPatience_s));
  EXPECT_EQ(without.verdicts.size(), 1U);
  EXPECT_EQ(without.failed, (std::vector<SubmapPair>{job.pairs[1]}));
  EXPECT_FALSE(worker_.holds_job());
  EXPECT_FALSE(worker_.next_timer().has_value());
}

TEST_F(DistantWorkerTest, AsksForFewAtATime) {
  Job job{.id = "1/0", .pairs = {}, .verifier = test::EvenVerifier().id()};
  for (std::uint32_t i = 0; i < 40; ++i) job.pairs.push_back({{kAlpha, i}, {kBravo, 2}});
  std::vector<SubmapId> open = asked(worker_.receive(envelope(job), Timestamp{}));
  std::size_t most = open.size(), came = 0;
  while (!open.empty()) {
    const SubmapId id = open.back();
    open.pop_back();
    const Step step = worker_.receive(copy(id, id), Timestamp{});
    for (const SubmapId& more : asked(step)) open.push_back(more);
    most = std::max(most, open.size());
    ++came;
  }
  EXPECT_EQ(came, 41U);
  EXPECT_EQ(most, WorkerNode::kMostAsked);
  EXPECT_FALSE(worker_.holds_job());
}

TEST_F(DistantWorkerTest, AnotherSubmapThanWasAskedForIsNotTaken) {
  static_cast<void>(worker_.receive(envelope(job_of(1)), Timestamp{}));
  EXPECT_EQ(worker_.receive(copy({kAlpha, 0}, {kAlpha, 1}), Timestamp{}).events.size(), 1U);
  bus::Envelope bad = copy({kAlpha, 0}, {kAlpha, 0});
  bad.bytes = std::make_shared<const std::string>(wire::encode(SubmapCopy{{kAlpha, 0}, "no frame"}));
  EXPECT_EQ(worker_.receive(bad, Timestamp{}).events.size(), 1U);
  static_cast<void>(worker_.receive(copy({kBravo, 3}, {kBravo, 3}), Timestamp{}));  // nobody asked
  EXPECT_EQ(cache_->bytes(), 0U);
  EXPECT_TRUE(worker_.holds_job());
}

TEST(FrameCache, KeepsTheNewestAndWhatIsNeeded) {
  FrameCache cache(10);
  for (std::uint32_t i = 0; i < 4; ++i) cache.put({kAlpha, i}, "12345");
  EXPECT_TRUE(cache.get({kAlpha, 1}).has_value());
  cache.trim({{kAlpha, 0}});
  EXPECT_EQ(cache.bytes(), 10U);
  EXPECT_TRUE(cache.contains({kAlpha, 0}) && cache.contains({kAlpha, 3}));
  EXPECT_FALSE(cache.get({kAlpha, 1}).has_value());
  cache.put({kAlpha, 0}, "1");
  EXPECT_EQ(cache.bytes(), 6U);
}

// A cache of the most recently used ones would have none of them.
TEST(FrameCache, ScannedAgainAndAgainItHasWhatFits) {
  constexpr std::uint32_t kSubmaps = 100, kRoom = 60;
  FrameCache cache(kRoom);
  std::size_t fetched = 0;
  for (int scan = 0; scan < 5; ++scan)
    for (std::uint32_t i = 0; i < kSubmaps; ++i) {
      if (cache.contains({kAlpha, i})) continue;
      ++fetched;
      cache.put({kAlpha, i}, "1");
      cache.trim({});
    }
  EXPECT_EQ(fetched, kSubmaps + 4 * (kSubmaps - kRoom));
}

TEST(SubmapFrames, ScannedAgainAndAgainTheyDecodeWhatDoesNotFit) {
  constexpr auto kSubmaps = static_cast<std::uint32_t>(SubmapFrames::kMostKept + 200);
  std::size_t fetched = 0;
  const SubmapFrames frames([&](SubmapId id) -> Result<std::string> {
    ++fetched;
    SubmapMessage message = test::submap(id.chain, 0);
    message.submap.id.index = id.index;
    message.submap.cloud.reset();
    return wire::encode(message);
  });
  for (int scan = 0; scan < 2; ++scan)
    for (std::uint32_t i = 0; i < kSubmaps; ++i) ASSERT_TRUE(frames.submap({kAlpha, i}).has_value());
  EXPECT_LE(fetched, kSubmaps + 201);
}

TEST_F(WorkerNodeTest, WhatIsNoJobIsRefused) {
  WorkerNode worker(kWorker, verifier_, frames());
  for (bus::Envelope bad : {test::envelope(test::submap(kAlpha, 0)), envelope({"1/0", {}})}) {
    if (bad.kind == bus::MessageKind::job) bad.bytes = std::make_shared<const std::string>("no frame");
    const Step step = worker.receive(bad, Timestamp{});
    EXPECT_TRUE(step.messages.empty());
    ASSERT_EQ(step.events.size(), 1U);
    EXPECT_TRUE(std::holds_alternative<MessageRefused>(step.events[0].what));
  }
}

TEST_F(WorkerNodeTest, AfterAJobThatItCannotDoItRestsForOthersToGetTheNext) {
  WorkerNode worker(kWorker, verifier_, frames());
  const Job job{.id = "1/0", .pairs = {{{kAlpha, 0}, {kBravo, 2}}}, .verifier = {"sonar", 2, 1}, .settings = "a: 1\n"};
  const Verdicts declined = answer(worker.receive(envelope(job), Timestamp{}));
  EXPECT_TRUE(declined.cannot);
  EXPECT_EQ(declined.failed, job.pairs);
  EXPECT_NE(declined.why.find("even 3"), std::string::npos) << declined.why;
  EXPECT_TRUE(worker.holds_job());
  ASSERT_EQ(worker.next_timer(), Timestamp{} + WorkerNode::kRest_s);
  EXPECT_TRUE(worker.on_timer(Timestamp{} + WorkerNode::kRest_s).messages.empty());
  EXPECT_FALSE(worker.holds_job());
  EXPECT_FALSE(worker.next_timer().has_value());
  worker.make_others_with(std::make_shared<test::EvenMaker>());
  EXPECT_TRUE(answer(worker.receive(envelope(job), Timestamp{})).cannot);
}

TEST_F(WorkerNodeTest, AFrameOfAnotherSubmapIsNoAnswer) {
  const SubmapFrames frames([](SubmapId) { return wire::encode(test::submap(kAlpha, 1)); });
  EXPECT_TRUE(frames.submap({kAlpha, 1}).has_value());
  EXPECT_TRUE(frames.cloud({kAlpha, 1}).has_value());
  EXPECT_FALSE(frames.submap({kAlpha, 2}).has_value());
  EXPECT_FALSE(frames.cloud({kBravo, 1}).has_value());
}

}  // namespace worker_node_test
}  // namespace tutti::node
