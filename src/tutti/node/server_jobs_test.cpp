// SPDX-License-Identifier: BSD-3-Clause
// Pairs that no worker can verify: they are asked again, and in the end refused.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "support/node/stored_server.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::node {
namespace server_jobs_test {

using bus::Endpoint, bus::MessageKind;
const ChainId kAlpha{RobotId{0}, 7}, kBravo{RobotId{1}, 7};
const SubmapPair kBad{{kAlpha, 0}, {kBravo, 0}};

class ServerJobs : public test::StoredServer {
 protected:
  ServerJobs() { restart(); }
  Step restart(double job_timeout_s = 600.0) {
    return start({RobotId{0}, RobotId{1}}, {.job_timeout_s = job_timeout_s});
  }
  static std::vector<Job> decoded(const std::vector<bus::Envelope>& sent) {
    std::vector<Job> jobs;
    for (const bus::Envelope& message : sent) jobs.push_back(wire::decode_job(*message.bytes).value());
    return jobs;
  }
  static std::vector<Job> jobs_of(const Step& step) { return decoded(of_kind(step, MessageKind::job)); }
  Step fail(const Job& job) {
    const Verdicts failed{.job = job.id, .verdicts = {}, .failed = job.pairs, .why = "no cloud"};
    return receive({Endpoint::worker(0), Endpoint::server(), MessageKind::verdicts, job.id,
                    std::make_shared<const std::string>(wire::encode(failed))});
  }
  /// As the bus does it when every worker that had it has ended.
  Step return_job(const Job& job, Endpoint from = Endpoint::any_worker()) {
    return receive(
        {from, Endpoint::server(), MessageKind::job, job.id, std::make_shared<const std::string>(wire::encode(job))});
  }
  void answer(const Job& job) {
    WorkerNode worker(Endpoint::worker(0), verifier_, SubmapFrames::of(*store_));
    const bus::Envelope asked{Endpoint::server(), Endpoint::any_worker(), MessageKind::job, job.id,
                              std::make_shared<const std::string>(wire::encode(job))};
    for (const bus::Envelope& verdicts : worker.receive(asked, now_).messages) receive(verdicts);
  }
  /// The jobs asked once the map's next update, and all that is due until `later`, have been.
  std::vector<Job> wait(double later) { return decoded(wait_for(MessageKind::job, later)); }
  static std::vector<bool> given_up(const Step& step) {
    std::vector<bool> out;
    for (const Event& event : step.events)
      if (const auto* failed = std::get_if<VerificationFailed>(&event.what)) out.push_back(failed->given_up);
    return out;
  }
  /// The one pair that everything is refused for, and stays refused.
  void expect_refused(const std::string& why) {
    const server::RefusalCounts refused = node_->map_server().refusals();
    ASSERT_TRUE(refused.contains(RefusalReason::unverified));
    EXPECT_EQ(refused.at(RefusalReason::unverified).inter, 1U);
    const MissionStatus status = node_->mission_status(now_);
    EXPECT_EQ(status.pending_jobs, 0U);
    ASSERT_EQ(status.refusals.size(), 1U);
    EXPECT_NE(status.refusals[0].last_why.find("0:7/0 and 1:7/0"), std::string::npos) << status.refusals[0].last_why;
    EXPECT_NE(status.refusals[0].last_why.find(why), std::string::npos) << status.refusals[0].last_why;
    EXPECT_TRUE(wait(1e6).empty());
    EXPECT_TRUE(jobs_of(restart()).empty());
    EXPECT_TRUE(node_->map_server().refusals().contains(RefusalReason::unverified));
  }
};

TEST_F(ServerJobs, APairThatFailsIsAskedAgainEveryTimeLaterAndThenRefused) {
  receive(test::submap(kAlpha, 0));
  std::vector<Job> asked = jobs_of(receive(test::submap(kBravo, 0)));
  for (const double later : {60.0, 120.0, 240.0}) {
    ASSERT_EQ(asked.size(), 1U);
    EXPECT_EQ(asked[0].pairs, std::vector{kBad});
    EXPECT_EQ(given_up(fail(asked[0])), std::vector{false});
    EXPECT_TRUE(given_up(fail(asked[0])).empty());  // the same answer
    EXPECT_EQ(node_->mission_status(now_).pending_jobs, 1U);
    EXPECT_TRUE(wait(later - 1.0).empty());
    asked = wait(1.0);
  }
  ASSERT_EQ(asked.size(), 1U);
  EXPECT_EQ(given_up(fail(asked[0])), std::vector{true});
  expect_refused("4 tries have failed: no cloud");
}

TEST_F(ServerJobs, APairThatIsVerifiedAfterAllHasNotFailed) {
  receive(test::submap(kAlpha, 0));
  fail(jobs_of(receive(test::submap(kBravo, 0))).at(0));
  answer(wait(60.0).at(0));
  EXPECT_EQ(node_->map_server().state().verdicts.at(kBad).closures.size(), 1U);
  EXPECT_TRUE(wait(1e6).empty());
  EXPECT_TRUE(node_->mission_status(now_).refusals.empty());
}

TEST_F(ServerJobs, WithoutATimeoutAPairComesAgainWithTheNextSubmap) {
  restart(0.0);
  receive(test::submap(kAlpha, 0));
  Job job = jobs_of(receive(test::submap(kBravo, 0))).at(0);
  for (std::uint32_t i = 1; i < 4; ++i) {
    EXPECT_EQ(given_up(fail({job.id, {kBad}})), std::vector{false});
    const std::vector<Job> asked = jobs_of(receive(test::submap(kAlpha, i)));
    const auto again = std::ranges::find_if(asked, [](const Job& a) { return std::ranges::count(a.pairs, kBad) > 0; });
    ASSERT_NE(again, asked.end());
    job = *again;
  }
  EXPECT_EQ(given_up(fail({job.id, {kBad}})), std::vector{true});
}

TEST_F(ServerJobs, AJobThatEndsEveryWorkerIsTakenApartAndThePairToBlameIsRefused) {
  receive(test::submap(kAlpha, 0));
  receive(test::submap(kAlpha, 1));
  for (const Job& job : jobs_of(receive(test::submap(kAlpha, 2)))) answer(job);
  wait(20.0);
  const std::vector<Job> asked = jobs_of(receive(test::submap(kBravo, 0)));
  ASSERT_EQ(asked.size(), 1U);
  ASSERT_EQ(asked[0].pairs.size(), 3U);
  EXPECT_TRUE(jobs_of(return_job(asked[0], Endpoint::worker(3))).empty());  // only the bus returns jobs
  const std::vector<Job> alone = jobs_of(return_job(asked[0]));
  ASSERT_EQ(alone.size(), 3U);
  EXPECT_TRUE(jobs_of(return_job(asked[0])).empty());
  for (const Job& job : alone) {
    ASSERT_EQ(job.pairs.size(), 1U);
    if (job.pairs[0] == kBad)
      EXPECT_EQ(given_up(return_job(job)), std::vector{true});
    else
      answer(job);
  }
  EXPECT_TRUE(node_->map_server().state().verdicts.contains({{kAlpha, 2}, {kBravo, 0}}));
  const std::vector<Job> later = wait(1300.0);  // what the first submaps were asked and nobody has answered
  for (const Job& job : later) answer(job);
  EXPECT_EQ(node_->map_server().refusals().at(RefusalReason::unverified).inter, 1U);
}

TEST_F(ServerJobs, AJobOfAnEarlierStartComesBackForNothing) {
  receive(test::submap(kAlpha, 0));
  const Job old = jobs_of(receive(test::submap(kBravo, 0))).at(0);
  const std::vector<Job> asked = jobs_of(restart());
  ASSERT_EQ(asked.size(), 1U);
  EXPECT_TRUE(return_job(old).events.empty());
  EXPECT_EQ(given_up(return_job(asked[0])), std::vector{true});
  expect_refused("every worker that had it has ended");
}

/// Answers that anybody can send: a verdict with other closures than the worker found.
class StrangeAnswers : public ServerJobs {
 protected:
  Job ask() {
    receive(test::submap(kAlpha, 0));
    return jobs_of(receive(test::submap(kBravo, 0))).at(0);
  }
  Step say(const Verdicts& sent) {
    return receive({Endpoint::worker(9), Endpoint::server(), MessageKind::verdicts, sent.job,
                    std::make_shared<const std::string>(wire::encode(sent))});
  }
  /// A verdict that refuses the job's pair.
  [[nodiscard]] Verdicts refusal_of(const std::string& job, const SubmapPair& pair = kBad) const {
    return {.job = job,
            .verdicts = {{.pair = pair,
                          .closures = {},
                          .refusal = Refusal{RefusalReason::unverified},
                          .verifier = verifier_->id()}},
            .failed = {},
            .why = {}};
  }
  [[nodiscard]] bool has_closure() const { return node_->map_server().state().verdicts.contains(kBad); }
};

TEST_F(StrangeAnswers, ToAJobThatIsAnsweredAreDropped) {
  const Job job = ask();
  answer(job);
  ASSERT_TRUE(has_closure());
  const auto before = store_->tables();
  EXPECT_TRUE(say(refusal_of(job.id)).writes.empty());
  EXPECT_TRUE(has_closure());
  EXPECT_EQ(store_->tables(), before);
}

/// Members' messages, sent again 10,000 times by somebody who has their credential and their disk.
TEST_F(StrangeAnswers, ReplaysChangeNothing) {
  const Job job = ask();
  WorkerNode worker(Endpoint::worker(0), verifier_, SubmapFrames::of(*store_));
  const bus::Envelope asked{Endpoint::server(), Endpoint::any_worker(), MessageKind::job, job.id,
                            std::make_shared<const std::string>(wire::encode(job))};
  const auto verdicts = worker.receive(asked, now_).messages;
  ASSERT_EQ(verdicts.size(), 1U);
  NodeStatus alpha{.name = "alpha", .version = "0"};
  alpha.session = 7;
  const std::vector<bus::Envelope> all{verdicts[0], test::envelope(test::submap(kAlpha, 0)),
                                       to_server(Endpoint::of(RobotId{0}), alpha)};
  for (const bus::Envelope& message : all) receive(message);
  const auto before = store_->tables();
  const auto state = node_->map_server().state().verdicts;
  const std::uint64_t jobs = node_->mission_status(now_).pending_jobs;
  ASSERT_TRUE(has_closure());
  for (int i = 0; i < 10'000; ++i)
    for (const bus::Envelope& message : all) receive(message);
  EXPECT_EQ(store_->tables(), before);
  EXPECT_EQ(node_->map_server().state().verdicts, state);
  EXPECT_EQ(node_->mission_status(now_).pending_jobs, jobs);
  receive(test::submap(kAlpha, 1));
  EXPECT_EQ(store_->tables().at("submaps").size(), 3U) << "it goes on";
}

TEST_F(StrangeAnswers, ToAJobOfAnotherStartOrOfNoneAreDropped) {
  const Job job = ask();
  restart();
  for (const std::string& name : {job.id, std::string("7/7/7")}) {
    EXPECT_TRUE(say(refusal_of(name)).writes.empty()) << name;
    EXPECT_FALSE(node_->map_server().state().answered.contains(kBad)) << name;
  }
  EXPECT_EQ(node_->mission_status(now_).pending_jobs, 1U);  // which is asked anew
}

TEST_F(StrangeAnswers, CountOnlyForWhatWasAsked) {
  answer(ask());
  ASSERT_TRUE(has_closure());
  const std::vector<Job> next = jobs_of(receive(test::submap(kAlpha, 1)));
  ASSERT_FALSE(next.empty());
  EXPECT_TRUE(say(refusal_of(next[0].id, kBad)).writes.empty());
  EXPECT_TRUE(has_closure());
  // It answered nothing of what it was asked: that has failed, and is asked again.
  EXPECT_FALSE(wait(60.0).empty());
}

TEST_F(StrangeAnswers, TheOldAnswerToWhatWasAskedAgainIsWelcome) {
  const Job job = ask();
  const std::vector<Job> again = wait(600.0);
  ASSERT_EQ(again.size(), 1U);
  ASSERT_NE(again[0].id, job.id);
  EXPECT_EQ(node_->mission_status(now_).pending_jobs, 1U);
  answer(job);
  EXPECT_TRUE(has_closure());
  answer(again[0]);
  EXPECT_EQ(node_->mission_status(now_).pending_jobs, 0U);
}

TEST_F(StrangeAnswers, OfAPartLeavesTheJobOpen) {
  const Job job = ask();
  EXPECT_FALSE(say(refusal_of(job.id + "+1")).writes.empty());  // as LaterAnswers names it
  EXPECT_EQ(node_->mission_status(now_).pending_jobs, 1U);
  say(refusal_of(job.id));
  EXPECT_EQ(node_->mission_status(now_).pending_jobs, 0U);
}

}  // namespace server_jobs_test
}  // namespace tutti::node
