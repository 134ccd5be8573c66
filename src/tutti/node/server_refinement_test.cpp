// SPDX-License-Identifier: BSD-3-Clause
// How a server has its map refined: by workers, who may fail, end, or be lost.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "support/node/stored_server.hpp"
#include "support/server/refiners.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/refinement_codec.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::node {
namespace server_refinement_test {

using bus::Endpoint, bus::MessageKind;
const ChainId kAlpha{RobotId{0}, 7};

class ServerRefinement : public test::StoredServer {
 protected:
  ServerRefinement() { restart(); }
  Step restart(double job_timeout_s = 600.0) {
    return start({RobotId{0}}, {.job_timeout_s = job_timeout_s, .refiner = refiner_});
  }
  /// Whose pairs are answered at once.
  void take(std::uint32_t index) {
    for (const bus::Envelope& job : of_kind(receive(test::submap(kAlpha, index)), MessageKind::job))
      for (const bus::Envelope& verdicts : worker_->receive(job, now_).messages) receive(verdicts);
  }
  static std::vector<bus::Envelope> asked(const Step& step) { return of_kind(step, MessageKind::refinement_job); }
  /// The refinements asked for once all that is due until `later` has been.
  std::vector<bus::Envelope> wait(double later) { return wait_for(MessageKind::refinement_job, later); }
  static Step answer_of(WorkerNode& worker, const bus::Envelope& job) { return worker.receive(job, Timestamp{}); }
  Step answer(const bus::Envelope& job) { return receive(answer_of(*worker_, job).messages.at(0)); }
  Step fail(const bus::Envelope& job) {
    WorkerNode blind(Endpoint::worker(1), verifier_, SubmapFrames::of(*store_));
    return receive(answer_of(blind, job).messages.at(0));
  }
  static std::optional<bool> given_up(const Step& step) {
    for (const Event& event : step.events)
      if (const auto* failed = std::get_if<RefinementFailed>(&event.what)) return failed->given_up;
    return std::nullopt;
  }
  [[nodiscard]] double length() const {
    const auto& nodes = node_->map_server().map().nodes;
    return (nodes.back().T_world_body.translation - nodes.front().T_world_body.translation).norm();
  }
  [[nodiscard]] std::size_t rows() const {
    return static_cast<std::size_t>(std::ranges::count_if(
        store_->tables().at("meta"), [](const auto& row) { return row.first.starts_with("refinement/"); }));
  }

  std::shared_ptr<const server::MapRefiner> refiner_ = std::make_shared<const server::test::Shrinker>();
  std::unique_ptr<WorkerNode> worker_ = [this] {
    auto worker = std::make_unique<WorkerNode>(Endpoint::worker(0), verifier_,
                                               std::make_shared<SubmapFrames>([this](SubmapId id) {
                                                 return Result<std::string>(**store_->read("submaps", key_of(id)));
                                               }));
    worker->refine_with(refiner_);
    return worker;
  }();
};

TEST_F(ServerRefinement, LeavesAsAJobAndTheNextUpdateHasIt) {
  for (std::uint32_t i = 0; i < 3; ++i) {
    take(i);
    const auto jobs = wait(10.0);
    ASSERT_EQ(jobs.size(), 1U);
    EXPECT_EQ(jobs[0].to, Endpoint::any_worker());
    EXPECT_EQ(node_->mission_status(now_).pending_jobs, 1U);
    const Step taken = answer(jobs[0]);
    EXPECT_TRUE(answer(jobs[0]).writes.empty());  // it comes twice
    EXPECT_TRUE(node_->map_server().has_news());
    EXPECT_TRUE(wait(1e4).empty());  // and then nothing more
    EXPECT_NEAR(length(), 0.99 * 3.0 * (i + 1), 1e-6);
    EXPECT_EQ(rows(), 1U);
  }
  EXPECT_EQ(node_->mission_status(now_).pending_jobs, 0U);
}

TEST_F(ServerRefinement, OfAPartIsFollowedByOneOfTheWholeWhenNothingMoreComes) {
  for (std::uint32_t i = 0; i < 6; ++i) take(i);
  answer(wait(10.0).at(0));
  EXPECT_TRUE(wait(100.0).empty());
  take(6);
  const auto part = wait(10.0);
  ASSERT_EQ(part.size(), 1U);
  EXPECT_FALSE(wire::decode_refinement_job(*part[0].bytes)->whole);
  answer(part[0]);
  EXPECT_TRUE(wait(45.0).empty());
  EXPECT_EQ(node_->mission_status(now_).pending_jobs, 1U);
  const auto whole = wait(10.0);
  ASSERT_EQ(whole.size(), 1U);
  EXPECT_TRUE(wire::decode_refinement_job(*whole[0].bytes)->whole);
  answer(whole[0]);
  EXPECT_TRUE(wait(1e4).empty());
  EXPECT_EQ(rows(), 1U);
  EXPECT_NEAR(length(), 0.99 * 21.0, 1e-6);
}

TEST_F(ServerRefinement, IsThereAfterARestart) {
  take(0);
  take(1);
  answer(wait(10.0).at(0));
  EXPECT_TRUE(asked(restart()).empty());  // news
  EXPECT_TRUE(wait(20.0).empty());
  EXPECT_NEAR(length(), 0.99 * 6.0, 1e-6);
  const std::uint64_t revision = node_->map_server().state().revision;
  EXPECT_TRUE(asked(restart()).empty());  // no news: the same map at once
  EXPECT_NEAR(length(), 0.99 * 6.0, 1e-6);
  EXPECT_EQ(node_->map_server().state().revision, revision);
}

TEST_F(ServerRefinement, AJobOfAnEarlierStartIsAskedAgain) {
  take(0);
  const auto first = wait(10.0);
  const auto again = asked(restart());
  ASSERT_EQ(again.size(), 1U);
  EXPECT_NE(again[0].id, first.at(0).id);
  answer(first[0]);  // that worker was late, and did the work
  answer(again[0]);
  EXPECT_TRUE(wait(1e4).empty());
  EXPECT_NEAR(length(), 0.99 * 3.0, 1e-6);
}

TEST_F(ServerRefinement, ThatFailsIsAskedAgainLaterAndThenGivenUp) {
  take(0);
  auto asked = wait(10.0);
  for (const double later : {60.0, 120.0, 240.0}) {
    ASSERT_EQ(asked.size(), 1U);
    EXPECT_EQ(given_up(fail(asked[0])), false);
    EXPECT_EQ(given_up(fail(asked[0])), std::nullopt);  // the same answer
    EXPECT_EQ(node_->mission_status(now_).pending_jobs, 1U);
    EXPECT_TRUE(wait(later - 1.0).empty());
    asked = wait(1.0);
  }
  EXPECT_EQ(given_up(fail(asked.at(0))), true);
  const MissionStatus status = node_->mission_status(now_);
  EXPECT_EQ(status.pending_jobs, 0U);
  ASSERT_EQ(status.refusals.size(), 1U);
  EXPECT_NE(status.refusals[0].last_why.find("revision 1 is given up"), std::string::npos)
      << status.refusals[0].last_why;
  EXPECT_TRUE(wait(1e6).empty());
  EXPECT_NEAR(length(), 3.0, 1e-6);  // the pose graph's map stands
  take(1);
  answer(wait(10.0).at(0));
  wait(10.0);
  EXPECT_NEAR(length(), 0.99 * 6.0, 1e-6);
}

TEST_F(ServerRefinement, ThatEndsEveryWorkerIsGivenUp) {
  take(0);
  bus::Envelope job = wait(10.0).at(0);
  job.from = Endpoint::any_worker();
  job.to = Endpoint::server();
  EXPECT_EQ(given_up(receive(job)), true);
  EXPECT_EQ(given_up(receive(job)), std::nullopt);
  EXPECT_TRUE(wait(1e6).empty());
}

TEST_F(ServerRefinement, ThatNobodyAnswersIsAskedAgain) {
  take(0);
  const bus::Envelope lost = wait(10.0).at(0);
  EXPECT_TRUE(wait(580.0).empty());
  const auto again = wait(10.0);
  ASSERT_EQ(again.size(), 1U);
  EXPECT_NE(again[0].id, lost.id);
  answer(lost);
  answer(again[0]);
  EXPECT_TRUE(wait(1e6).empty());
  EXPECT_NEAR(length(), 0.99 * 3.0, 1e-6);
}

TEST_F(ServerRefinement, WithoutATimeoutThatFailsIsAskedForWithTheNextSubmap) {
  restart(0.0);
  take(0);
  EXPECT_EQ(given_up(fail(wait(10.0).at(0))), true);
  EXPECT_TRUE(wait(1e6).empty());
  take(1);
  EXPECT_EQ(wait(10.0).size(), 1U);
}

TEST_F(ServerRefinement, ADistantWorkerGetsTheSubmapsFirst) {
  take(0);
  take(1);
  const bus::Envelope job = wait(10.0).at(0);
  WorkerNode distant(Endpoint::worker(5), verifier_, std::make_shared<FrameCache>(1U << 20U));
  distant.refine_with(refiner_);
  std::vector<bus::Envelope> request = distant.receive(job, now_).messages;
  ASSERT_EQ(request.size(), 1U);
  EXPECT_TRUE(distant.holds_job());
  std::optional<bus::Envelope> last;
  for (const bus::Envelope& copy : receive(request[0]).messages)
    for (bus::Envelope& message : distant.receive(copy, now_).messages) last = std::move(message);
  ASSERT_TRUE(last.has_value());
  const auto near = wire::decode_refinement(*answer_of(*worker_, job).messages.at(0).bytes);
  EXPECT_EQ(wire::decode_refinement(*last->bytes).value(), near.value());
  EXPECT_FALSE(distant.holds_job());
}

TEST_F(ServerRefinement, WhatIsNoneIsRefused) {
  take(0);
  const bus::Envelope job = wait(10.0).at(0);
  for (const MessageKind kind : {MessageKind::refinement, MessageKind::refinement_job}) {
    bus::Envelope bad = job;
    bad.kind = kind;
    bad.from = kind == MessageKind::refinement ? Endpoint::worker(0) : Endpoint::any_worker();
    bad.bytes = std::make_shared<const std::string>("garbage");
    const Step step = receive(bad);
    ASSERT_EQ(step.events.size(), 1U);
    EXPECT_TRUE(std::holds_alternative<MessageRefused>(step.events[0].what));
  }
  EXPECT_EQ(node_->mission_status(now_).pending_jobs, 1U);
}

}  // namespace server_refinement_test
}  // namespace tutti::node
