// SPDX-License-Identifier: BSD-3-Clause
// A server's loop-closure verifier and those of its workers, with the same settings and with others.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "support/node/stored_server.hpp"
#include "support/server/refiners.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/node/worker_node.hpp"

namespace tutti::node {
namespace server_verifiers_test {

using bus::Endpoint, bus::MessageKind;
const ChainId kAlpha{RobotId{0}, 7}, kBravo{RobotId{1}, 7};
const SubmapPair kPair{{kAlpha, 0}, {kBravo, 0}};

/// Another kind than EvenVerifier: what a worker has that was started for another mission.
class OtherVerifier final : public server::ClosureVerifier {
 public:
  explicit OtherVerifier(MethodId id = {"other", 8, 0}) : id_(std::move(id)) {}
  [[nodiscard]] MethodId id() const override { return id_; }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap&, const Submap&) const override { return true; }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore&) const override {
    return ClosureVerdict{{first.id, second.id}, {}, Refusal{RefusalReason::too_small, 0, 500}, id_};
  }

 private:
  MethodId id_;
};

/// Its name makes its jobs for it alone.
class NamedShrinker final : public server::MapRefiner {
 public:
  [[nodiscard]] MethodId id() const override { return {"shrinker", 1, 7}; }
  [[nodiscard]] bool can_refine(const PayloadSize& size) const override { return shrinker_.can_refine(size); }
  [[nodiscard]] Result<Refinement> refine(const RefinementJob& job, const server::SubmapSet& submaps,
                                          const server::PayloadStore& payloads) const override {
    return shrinker_.refine(job, submaps, payloads);
  }

 private:
  server::test::Shrinker shrinker_;
};

class ServerVerifiers : public test::StoredServer {
 protected:
  ServerVerifiers() { restart(); }
  Step restart() { return start({RobotId{0}, RobotId{1}}, {.refiner = refiner_}); }
  Step restart(std::shared_ptr<const server::ClosureVerifier> verifier) {
    verifier_ = std::move(verifier);
    return restart();
  }
  WorkerNode worker(std::uint32_t number, std::shared_ptr<const server::ClosureVerifier> verifier, bool makes = false) {
    auto frames = std::make_shared<SubmapFrames>(
        [this](SubmapId id) { return Result<std::string>(**store_->read("submaps", key_of(id))); });
    WorkerNode made(Endpoint::worker(number), std::move(verifier), std::move(frames));
    if (makes) made.make_others_with(std::make_shared<test::EvenMaker>());
    return made;
  }
  static std::vector<bus::Envelope> jobs(const Step& step) { return of_kind(step, MessageKind::job); }
  /// The one pair of two submaps.
  bus::Envelope ask() {
    receive(test::submap(kAlpha, 0));
    return jobs(receive(test::submap(kBravo, 0))).at(0);
  }
  Step answer(WorkerNode& worker, const bus::Envelope& job) {
    return receive(worker.receive(job, now_).messages.at(0));
  }
  Step hear(const WorkerNode& worker, std::uint32_t number) {
    return receive(to_server(Endpoint::worker(number), {.name = "worker", .can = worker.can()}));
  }
  [[nodiscard]] bool has_closure() const { return node_->map_server().state().verdicts.contains(kPair); }
  [[nodiscard]] MissionStatus status() const { return node_->mission_status(now_); }

  std::shared_ptr<const server::MapRefiner> refiner_;
};

TEST_F(ServerVerifiers, AWorkerWithoutAMissionMakesTheVerifierOfTheJob) {
  WorkerNode bare = worker(3, std::make_shared<OtherVerifier>(), true);
  answer(bare, ask());
  EXPECT_TRUE(has_closure());
  EXPECT_EQ(node_->map_server().state().verdicts.at(kPair).verifier, verifier_->id());
  EXPECT_FALSE(bare.holds_job());
  restart(std::make_shared<test::EvenVerifier>("gap: 2\n"));  // settings that it has not met
  for (const bus::Envelope& job : jobs(restart())) answer(bare, job);
  EXPECT_EQ(node_->map_server().state().verdicts.at(kPair).verifier, verifier_->id());
}

TEST_F(ServerVerifiers, WhatAWorkerCannotDoWaitsForOneThatCan) {
  WorkerNode unable = worker(3, std::make_shared<OtherVerifier>());
  hear(unable, 3);
  const Step declined = answer(unable, ask());
  EXPECT_TRUE(jobs(declined).empty());
  EXPECT_EQ(status().waiting, 1U);
  EXPECT_EQ(status().pending_jobs, 1U);
  EXPECT_NE(status().why_waiting.find("other 8"), std::string::npos) << status().why_waiting;
  EXPECT_TRUE(wait_for(MessageKind::job, 1e6).empty());
  EXPECT_TRUE(jobs(hear(unable, 3)).empty());
  EXPECT_TRUE(node_->map_server().refusals().empty());

  WorkerNode proper = worker(4, verifier_);
  const auto again = jobs(hear(proper, 4));
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(status().waiting, 0U);
  answer(proper, again[0]);
  EXPECT_TRUE(has_closure());
  EXPECT_TRUE(jobs(hear(proper, 4)).empty());
  EXPECT_EQ(status().pending_jobs, 0U);
}

TEST_F(ServerVerifiers, WhatAWorkerCannotDoIsAskedAgainAtOnceWhereAnotherCan) {
  WorkerNode unable = worker(3, std::make_shared<OtherVerifier>());
  const WorkerNode maker = worker(4, std::make_shared<OtherVerifier>(), true);
  hear(maker, 4);
  const bus::Envelope job = ask();
  const auto again = jobs(answer(unable, job));
  ASSERT_EQ(again.size(), 1U);
  WorkerNode another = worker(5, std::make_shared<OtherVerifier>());
  EXPECT_TRUE(jobs(answer(another, job)).empty());  // which is not open any more
  EXPECT_EQ(status().waiting, 0U);
  now_ = now_ + 60.0;  // not heard for a minute: it is gone
  WorkerNode third = worker(6, std::make_shared<OtherVerifier>());
  EXPECT_TRUE(jobs(answer(third, again[0])).empty());
  EXPECT_EQ(status().waiting, 1U);
}

TEST_F(ServerVerifiers, AJobThatAWorkerCannotReadWaitsForAnotherWorker) {
  const bus::Envelope job = ask();
  bus::Envelope newer = job;
  newer.bytes = std::make_shared<const std::string>(test::raised(*job.bytes));
  WorkerNode older = worker(3, verifier_);
  receive(older.receive(newer, now_).messages.at(0));
  EXPECT_EQ(status().waiting, 1U);
  EXPECT_NE(status().why_waiting.find("this program reads versions"), std::string::npos) << status().why_waiting;
  WorkerNode proper = worker(4, verifier_);
  const auto again = of_kind(hear(proper, 4), MessageKind::job);
  ASSERT_EQ(again.size(), 1U);
  answer(proper, again[0]);
  EXPECT_TRUE(has_closure());
  EXPECT_EQ(status().waiting, 0U);
}

TEST_F(ServerVerifiers, AVerdictOfAnUnknownVerifierIsKeptButNotBelieved) {
  const MethodId of_old_programs{"", 3, 0};
  const bus::Envelope job = ask();
  Verdicts sent = wire::decode_verdicts(*worker(3, verifier_).receive(job, now_).messages.at(0).bytes).value();
  sent.verdicts.at(0).verifier = of_old_programs;
  const auto envelope = [&] {
    return bus::Envelope{Endpoint::worker(3), Endpoint::server(), MessageKind::verdicts, sent.job,
                         std::make_shared<const std::string>(wire::encode(sent))};
  };
  const Step taken = receive(envelope());
  EXPECT_FALSE(has_closure());
  EXPECT_EQ(status().waiting, 1U);
  ASSERT_EQ(status().refusals.size(), 1U);
  EXPECT_NE(status().refusals[0].last_why.find("unnamed 3"), std::string::npos) << status().refusals[0].last_why;
  EXPECT_EQ(store_->tables().at("answers").size(), 1U);
  receive(envelope());  // of a job that is not open any more: nothing is stored twice
  EXPECT_EQ(store_->tables().at("answers").size(), 1U);

  EXPECT_EQ(jobs(restart()).size(), 1U);  // as if it had not come
  EXPECT_FALSE(has_closure());
  restart(std::make_shared<OtherVerifier>(MethodId{"unnamed", 3, 0}));
  EXPECT_FALSE(has_closure());
}

TEST_F(ServerVerifiers, WhatWasSetAsideIsBelievedWhenItsVerifierIsTheServers) {
  const auto other = std::make_shared<test::EvenVerifier>("gap: 1\n");
  const bus::Envelope job = ask();
  Verdicts sent = wire::decode_verdicts(*worker(3, verifier_).receive(job, now_).messages.at(0).bytes).value();
  sent.verdicts.at(0).verifier = other->id();
  receive({Endpoint::worker(3), Endpoint::server(), MessageKind::verdicts, sent.job,
           std::make_shared<const std::string>(wire::encode(sent))});
  EXPECT_FALSE(has_closure());
  EXPECT_TRUE(jobs(restart(other)).empty());
  ASSERT_TRUE(has_closure());
  EXPECT_EQ(node_->map_server().state().verdicts.at(kPair).verifier, other->id());
}

TEST_F(ServerVerifiers, AnotherVerifierKeepsClosuresUntilItHasAnswered) {
  WorkerNode first = worker(3, verifier_);
  answer(first, ask());
  const auto even = verifier_;
  const auto asked = jobs(restart(std::make_shared<OtherVerifier>()));
  ASSERT_EQ(asked.size(), 1U);
  EXPECT_TRUE(has_closure());
  EXPECT_EQ(status().former_pairs, 1U);
  EXPECT_EQ(status().verifier, "other 8");
  EXPECT_TRUE(wait_for(MessageKind::job, 30.0).empty());
  EXPECT_EQ(node_->map_server().map().closures.size(), 1U);

  EXPECT_TRUE(jobs(restart(even)).empty());  // and back: it had answered
  EXPECT_EQ(status().former_pairs, 0U);
  WorkerNode second = worker(4, std::make_shared<OtherVerifier>());
  answer(second, jobs(restart(std::make_shared<OtherVerifier>())).at(0));  // which refuses
  EXPECT_FALSE(has_closure());
  EXPECT_TRUE(jobs(restart()).empty());
  EXPECT_EQ(jobs(restart(even)).size(), 1U);
}

TEST_F(ServerVerifiers, ARefinementThatAWorkerCannotDoWaitsForOneThatCan) {
  refiner_ = std::make_shared<const NamedShrinker>();
  restart();
  WorkerNode unable = worker(3, verifier_, true);
  answer(unable, ask());
  const auto asked = wait_for(MessageKind::refinement_job, 10.0);
  ASSERT_EQ(asked.size(), 1U);
  receive(unable.receive(asked[0], now_).messages.at(0));
  EXPECT_TRUE(unable.holds_job());  // rests
  EXPECT_EQ(status().waiting, 1U);
  EXPECT_NE(status().why_waiting.find("shrinker 1"), std::string::npos) << status().why_waiting;
  EXPECT_TRUE(wait_for(MessageKind::refinement_job, 1e5).empty());

  WorkerNode proper = worker(4, verifier_);
  proper.refine_with(refiner_);
  const auto again = of_kind(hear(proper, 4), MessageKind::refinement_job);
  ASSERT_EQ(again.size(), 1U);
  receive(proper.receive(again[0], now_).messages.at(0));
  EXPECT_EQ(status().waiting, 0U);
  EXPECT_TRUE(wait_for(MessageKind::refinement_job, 1e3).empty());
  EXPECT_EQ(node_->map_server().state().refinements.all().size(), 1U);
  EXPECT_TRUE(status().refusals.empty());  // none was given up
}

}  // namespace server_verifiers_test
}  // namespace tutti::node
