// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/decision_sender.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <string>

#include "support/node/submaps.hpp"
#include "tutti/bus/bus_credentials.hpp"
#include "tutti/node/marks.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::node {
namespace decision_sender_test {

using bus::Endpoint;

/// A server with one closure, and whoever sends decisions to it over a bus that loses some.
class Decisions : public testing::Test {
 protected:
  Decisions() {
    start();
    for (std::uint32_t i = 0; i < 3; ++i)
      for (const bus::Envelope& message :
           does(server_->receive(test::envelope(test::submap({RobotId{0}, 7}, i)), {}))) {
        if (message.kind != bus::MessageKind::job) continue;
        WorkerNode worker(Endpoint::worker(0), verifier_, SubmapFrames::of(store_));
        for (const bus::Envelope& verdicts : worker.receive(message, {}).messages) does(server_->receive(verdicts, {}));
      }
  }
  void start() {
    server_ = ServerNode::open({RobotId{0}}, verifier_, {}, 1000, store_).value();
    does(server_->resume({}));
  }
  std::vector<bus::Envelope> does(const Step& step) {
    EXPECT_TRUE(store_.commit(step.writes).has_value());
    return step.messages;
  }
  /// As it comes over the bus.
  [[nodiscard]] MissionStatus status() const {
    return wire::decode_mission_status(wire::encode(server_->mission_status({}))).value();
  }
  [[nodiscard]] std::size_t decisions() const { return server_->map_server().state().decisions.size(); }

  const Endpoint kSelf = Endpoint::viewer(9);
  storage::MemoryStore store_{storage::map_schema()};
  std::shared_ptr<const server::ClosureVerifier> verifier_ = std::make_shared<test::EvenVerifier>();
  std::unique_ptr<ServerNode> server_;
};

TEST_F(Decisions, IsSentUntilItIsAnswered) {
  const ClosureDecision decision{"0/0-0/2", Wish::reject, "ada", 5};
  DecisionSender sender(kSelf, decision);
  std::set<std::string> ids;
  for (double now_s = 100.0; now_s < 112.0; now_s += 0.5)  // the bus loses each
    if (const auto envelope = sender.due(now_s)) {
      EXPECT_TRUE(ids.insert(envelope->id).second) << envelope->id;
      EXPECT_EQ(wire::decode_decision(*envelope->bytes), decision);
    }
  EXPECT_EQ(ids.size(), 3U);
  EXPECT_EQ(sender.answer(status()), std::nullopt);
  const auto again = sender.due(115.0);
  ASSERT_TRUE(again.has_value());
  const std::uint64_t changes = server_->changes();
  for (int i = 0; i < 2; ++i) {  // it comes twice
    does(server_->receive(*again, {}));
    EXPECT_EQ(sender.answer(status()), "");
    EXPECT_EQ(decisions(), 1U);
  }
  EXPECT_GT(server_->changes(), changes);  // the status comes at once
  start();                                 // before the answer was heard
  EXPECT_EQ(sender.answer(status()), "");
}

TEST_F(Decisions, WhatIsNotTakenIsAnsweredWithTheReason) {
  const auto answer = [&](const ClosureDecision& decision) {
    DecisionSender sender(kSelf, decision);
    does(server_->receive(*sender.due(0.0), {}));
    return sender.answer(status()).value_or("not answered");
  };
  EXPECT_NE(answer({"nobody/0-0/2", Wish::reject, "ada", 5}).find("nobody"), std::string::npos);
  EXPECT_EQ(answer({"0/0-0/2", Wish::reject, "ada", 5}), "");
  EXPECT_EQ(answer({"0/0-0/2", Wish::accept, "eve", 4}), "a later decision on it holds");
  EXPECT_EQ(answer({"0/0-0/2", Wish::accept, "eve", 6}), "");
  EXPECT_EQ(decisions(), 1U);
}

TEST_F(Decisions, AMarkIsStoredOnceHoweverOftenItComes) {
  const MapMark door{.submap = {{RobotId{0}, 7}, 1}, .text = "door", .by = "ada", .given_ns = 9};
  DecisionSender sender(kSelf, MarkOrder{.number = 9, .mark = door, .given_ns = 9});
  const auto message = sender.due(0.0).value();
  for (int i = 0; i < 2; ++i) {
    does(server_->receive(message, {}));
    EXPECT_EQ(sender.answer(status()), "");
    if (i == 0) start();
  }
  EXPECT_EQ(read_marks(store_).value(), (MarkSet{{9, door}}));
  DecisionSender removes(kSelf, MarkOrder{.number = 9, .given_ns = 10});
  const auto removal = removes.due(0.0).value();
  for (int i = 0; i < 2; ++i) does(server_->receive(removal, {}));
  EXPECT_EQ(removes.answer(status()), "");
  EXPECT_TRUE(read_marks(store_)->empty());
  DecisionSender none(kSelf, MarkOrder{.number = 8, .given_ns = 11});
  does(server_->receive(none.due(0.0).value(), {}));
  EXPECT_EQ(none.answer(status()), "there is no such mark");
}

/// The page has asked who decides there; nobody else speaks for others.
TEST_F(Decisions, OnlyThePageSpeaksForOthers) {
  std::int64_t given_ns = 5;
  const auto author = [&](const std::string& user, const std::string& by) {
    auto message = DecisionSender(kSelf, {"0/0-0/2", Wish::reject, by, ++given_ns}).due(0.0).value();
    message.user = user;
    does(server_->receive(message, {}));
    return server_->map_server().state().decisions.begin()->second.by;
  };
  EXPECT_EQ(author("", "ada"), "ada") << "nobody has proved anything";
  EXPECT_EQ(author("eve", "ada"), "eve");
  EXPECT_EQ(author(bus::kPageUser, "ada"), "ada");
  EXPECT_EQ(author(bus::kPageUser, ""), bus::kPageUser);
}

TEST_F(Decisions, OnlyTheLastAreReported) {
  for (int i = 0; i < 100; ++i)
    does(server_->receive(*DecisionSender(kSelf, {"0/0-0/2", Wish::reject, "ada", i}).due(0.0), {}));
  EXPECT_EQ(status().decisions.size(), 32U);
  EXPECT_EQ(DecisionSender(kSelf, {"0/0-0/2", Wish::reject, "ada", 99}).answer(status()), "");
  EXPECT_EQ(DecisionSender(kSelf, {"0/0-0/2", Wish::reject, "ada", 50}).answer(status()), std::nullopt);
}

}  // namespace decision_sender_test
}  // namespace tutti::node
