// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/worker_node.hpp"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "support/node/submaps.hpp"

namespace tutti::node {
namespace {

const ChainId kAlpha{RobotId{0}, 7}, kBravo{RobotId{1}, 7};
const bus::Endpoint kWorker = bus::Endpoint::worker(0);

class WorkerNodeTest : public testing::Test {
 protected:
  /// Of submaps below 4.
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
  std::shared_ptr<const server::ClosureFinder> finder_ = std::make_shared<test::EvenFinder>();
};

TEST_F(WorkerNodeTest, AnswersEveryPairOfAJobTheSameOnAnyNumberOfThreads) {
  Job job{.id = "1/0", .pairs = {}};
  for (std::uint32_t i = 0; i < 5; ++i) job.pairs.push_back({{kAlpha, i}, {kBravo, 2}});
  WorkerNode alone(kWorker, finder_, frames());
  const Verdicts verdicts = answer(alone.receive(envelope(job), Timestamp{}));
  EXPECT_EQ(verdicts.job, "1/0");
  ASSERT_EQ(verdicts.verdicts.size(), 4U);
  for (const ClosureVerdict& verdict : verdicts.verdicts)
    EXPECT_EQ(verdict.closures.size(), verdict.pair.first.index % 2 == 0 ? 1U : 0U);
  EXPECT_EQ(verdicts.failed, (std::vector<SubmapPair>{job.pairs[4]}));
  EXPECT_NE(verdicts.why.find("no submap"), std::string::npos) << verdicts.why;

  WorkerNode many(kWorker, finder_, frames(), [](std::size_t count, const std::function<void(std::size_t)>& call) {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < count; ++i) threads.emplace_back(call, count - 1 - i);
  });
  EXPECT_EQ(answer(many.receive(envelope(job), Timestamp{})), verdicts);
  EXPECT_EQ(answer(many.receive(envelope(job), Timestamp{})), verdicts);  // again
}

TEST_F(WorkerNodeTest, WhatIsNoJobIsRefused) {
  WorkerNode worker(kWorker, finder_, frames());
  for (bus::Envelope bad : {test::envelope(test::submap(kAlpha, 0)), envelope({"1/0", {}})}) {
    if (bad.kind == bus::MessageKind::job) bad.bytes = std::make_shared<const std::string>("no frame");
    const Step step = worker.receive(bad, Timestamp{});
    EXPECT_TRUE(step.messages.empty());
    ASSERT_EQ(step.events.size(), 1U);
    EXPECT_TRUE(std::holds_alternative<MessageRefused>(step.events[0].what));
  }
}

TEST_F(WorkerNodeTest, AFrameOfAnotherSubmapIsNoAnswer) {
  const SubmapFrames frames([](SubmapId) { return wire::encode(test::submap(kAlpha, 1)); });
  EXPECT_TRUE(frames.submap({kAlpha, 1}).has_value());
  EXPECT_TRUE(frames.get({kAlpha, 1}).has_value());
  EXPECT_FALSE(frames.submap({kAlpha, 2}).has_value());
  EXPECT_FALSE(frames.get({kBravo, 1}).has_value());
}

}  // namespace
}  // namespace tutti::node
