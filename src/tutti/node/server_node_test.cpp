// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/server_node.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "support/node/stored_server.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/submap_copy_codec.hpp"

namespace tutti::node {
namespace server_node_test {

using bus::Endpoint, bus::MessageKind;
const ChainId kAlpha{RobotId{0}, 7}, kBravo{RobotId{1}, 7};

/// And a worker beside it.
class ServerNodeTest : public test::StoredServer {
 protected:
  ServerNodeTest() { restart(); }
  void restart() { resumed_ = start({RobotId{0}, RobotId{1}}, {.pairs_per_job = 2}); }
  static std::set<SubmapPair> pairs_of(const Step& step) {
    std::set<SubmapPair> pairs;
    for (const auto& job : of_kind(step, MessageKind::job)) {
      const Job decoded = wire::decode_job(*job.bytes).value();
      EXPECT_LE(decoded.pairs.size(), 2U);
      EXPECT_EQ(decoded.id, job.id);
      pairs.insert(decoded.pairs.begin(), decoded.pairs.end());
    }
    return pairs;
  }
  template <class What>
  static std::size_t reported(const Step& step) {
    return static_cast<std::size_t>(
        std::ranges::count_if(step.events, [](const Event& e) { return std::holds_alternative<What>(e.what); }));
  }
  /// Everything that a step asks workers for is answered, and so many times taken.
  void answer(const Step& step, std::size_t taken = 1) {
    WorkerNode worker(Endpoint::worker(0), verifier_, SubmapFrames::of(*store_));
    for (const auto& job : of_kind(step, MessageKind::job))
      for (const auto& verdicts : worker.receive(job, now_).messages)
        EXPECT_EQ(reported<VerdictsTaken>(receive(verdicts)), taken);
  }
  void fill() {
    for (std::uint32_t i = 0; i < 4; ++i)
      for (const ChainId& chain : {kAlpha, kBravo}) answer(receive(test::submap(chain, i)));
  }

  Step resumed_;
};

TEST_F(ServerNodeTest, GivesWorkersCopiesOfWhatItHasStored) {
  const SubmapMessage stored = test::submap(kAlpha, 0);
  receive(stored);
  const Step asked = receive(test::submap(kBravo, 0));
  bus::Envelope request{
      Endpoint::worker(5),
      Endpoint::server(),
      MessageKind::submap_request,
      {},
      std::make_shared<const std::string>(wire::encode(SubmapRequest{{stored.submap.id, {kBravo, 7}}}))};
  const Step step = receive(request);
  ASSERT_EQ(step.messages.size(), 2U);
  EXPECT_EQ(step.messages[0].to, Endpoint::worker(5));
  EXPECT_EQ(wire::decode_submap_copy(*step.messages[0].bytes).value(),
            (SubmapCopy{stored.submap.id, *test::envelope(stored).bytes}));
  EXPECT_EQ(wire::decode_submap_copy(*step.messages[1].bytes).value(), (SubmapCopy{{kBravo, 7}, ""}));  // not there
  request.from = Endpoint::of(RobotId{0});
  EXPECT_TRUE(receive(request).messages.empty());
  answer(asked);  // no job is out that needs it
  request.from = Endpoint::worker(5);
  const Step late = receive(request);
  ASSERT_EQ(late.messages.size(), 2U);
  EXPECT_EQ(wire::decode_submap_copy(*late.messages[0].bytes).value(), (SubmapCopy{stored.submap.id, ""}));
}

TEST_F(ServerNodeTest, SaysWhatItHasStoredAndAsksForTheNewPairs) {
  EXPECT_TRUE(resumed_.messages.empty());
  receive(test::submap(kAlpha, 0));
  receive(test::submap(kBravo, 0));
  const Step step = receive(test::submap(kAlpha, 2));
  EXPECT_EQ(reported<SubmapStored>(step), 1U);
  EXPECT_EQ(store_->tables().at("submaps").size(), 3U);
  const auto receipts = of_kind(step, MessageKind::receipt);
  ASSERT_EQ(receipts.size(), 1U);
  EXPECT_EQ(receipts[0].to, Endpoint::of(RobotId{0}));
  const Receipt receipt = wire::decode_receipt(*receipts[0].bytes).value();
  for (std::uint32_t i = 0; i < 4; ++i) EXPECT_EQ(receipt.contains({kAlpha, i}), i % 2 == 0);
  EXPECT_FALSE(receipt.contains({kBravo, 0}));
  EXPECT_EQ(pairs_of(step), (std::set<SubmapPair>{{{kAlpha, 0}, {kAlpha, 2}}, {{kAlpha, 2}, {kBravo, 0}}}));
  EXPECT_EQ(of_kind(step, MessageKind::job).size(), 1U);  // the new submap against both
  EXPECT_EQ(*store_->read("submaps", key_of(SubmapId{kAlpha, 2})).value(), wire::encode(test::submap(kAlpha, 2)));
}

TEST_F(ServerNodeTest, ASubmapThatComesAgainIsOnlyConfirmed) {
  receive(test::submap(kAlpha, 0));
  const auto before = store_->tables();
  const Step step = receive(test::submap(kAlpha, 0));
  EXPECT_EQ(store_->tables(), before);
  EXPECT_EQ(of_kind(step, MessageKind::receipt).size(), 1U);
  EXPECT_EQ(step.messages.size(), 1U);
  EXPECT_TRUE(step.events.empty());
}

TEST_F(ServerNodeTest, ASubmapThatComesAgainBeforeItIsStoredIsUnderWay) {
  const bus::Envelope first = test::envelope(test::submap(kAlpha, 0));
  bus::Envelope again = first;  // as a robot sends what it has sent to an earlier server
  again.id = message_id({kAlpha, 0}, 5);
  const Step step = node_->receive(first, now_);
  EXPECT_EQ(of_kind(step, MessageKind::receipt).size(), 1U);
  const Step nothing = node_->receive(again, now_);
  EXPECT_TRUE(nothing.messages.empty() && nothing.writes.empty() && nothing.events.empty());
  ASSERT_TRUE(store_->commit(step.writes));
  EXPECT_EQ(of_kind(node_->receive(again, now_), MessageKind::receipt).size(), 1U);
}

TEST_F(ServerNodeTest, RefusesWhatIsNoGoodAndStoresNothingOfIt) {
  const auto before = store_->tables();
  bus::Envelope forged = test::envelope(test::submap(kAlpha, 0));
  forged.from = Endpoint::of(RobotId{1});
  bus::Envelope stranger = test::envelope(test::submap({RobotId{9}, 7}, 0));
  bus::Envelope garbage = test::envelope(test::submap(kAlpha, 0));
  garbage.bytes = std::make_shared<const std::string>("TU garbage");
  garbage.id = "of no submap";
  bus::Envelope other = garbage;
  other.kind = MessageKind::verdicts;
  bus::Envelope misplaced = forged;
  misplaced.kind = MessageKind::proxy_graph;
  for (const bus::Envelope& bad : {forged, stranger, garbage, other, misplaced}) {
    const Step step = receive(bad);
    EXPECT_EQ(reported<MessageRefused>(step), 1U);
    EXPECT_TRUE(step.messages.empty());
  }
  EXPECT_EQ(store_->tables(), before);
  EXPECT_EQ(node_->next_timer(), std::nullopt);
}

TEST_F(ServerNodeTest, UpdatesTheMapAtOnceAndOnlyWithNews) {
  EXPECT_EQ(node_->next_timer(), std::nullopt);
  now_ = Timestamp{} + 13.0;
  EXPECT_TRUE(done(node_->on_timer(now_)).messages.empty());
  receive(test::submap(kAlpha, 0));
  ASSERT_EQ(node_->next_timer(), now_);
  const Step step = done(node_->on_timer(now_));
  const auto graphs = of_kind(step, MessageKind::proxy_graph);
  ASSERT_EQ(graphs.size(), 2U);
  EXPECT_EQ(wire::decode_proxy_graph(*graphs[0].bytes)->graph.age(),
            (std::pair<std::uint64_t, std::uint64_t>(1001, 1)));
  EXPECT_EQ(reported<MapUpdated>(step), 1U);
  EXPECT_EQ(node_->next_timer(), std::nullopt);
  EXPECT_TRUE(done(node_->on_timer(now_)).messages.empty());
  receive(test::submap(kAlpha, 0));  // no news
  EXPECT_EQ(node_->next_timer(), std::nullopt);
}

TEST_F(ServerNodeTest, SendsDeltasWhileTheyAreSmallerThanWhatIsSentOnAverage) {
  std::optional<ProxyGraph> base;
  std::size_t full = 0, deltas = 0, messages = 0, bytes = 0;
  for (std::uint32_t i = 0; i < 40; ++i) {
    receive(test::submap(kAlpha, i));
    now_ = *node_->next_timer() + server::ServerConfig{}.unchanged_every_s;  // whether or not it concerns the robot
    for (const bus::Envelope& sent : done(node_->on_timer(now_)).messages) {
      if (sent.to != Endpoint::of(kAlpha.robot)) continue;
      ProxyGraphMessage message;
      if (sent.kind == MessageKind::proxy_graph) {
        message = wire::decode_proxy_graph(*sent.bytes).value();
        base = message.graph;
        messages = bytes = 0;
        ++full;
      } else {
        message = wire::decode_delta(*sent.bytes, base.value()).value().value();
        EXPECT_LE(sent.bytes->size() * messages, bytes);
        ++deltas;
      }
      ++messages;
      bytes += sent.bytes->size();
      EXPECT_EQ(message.graph.age(), node_->broadcast().age());
      const auto own = consistency::own_part(node_->broadcast(), kAlpha.robot);
      EXPECT_EQ(message.graph, wire::decode_proxy_graph(wire::encode({message.header, own}))->graph);
    }
  }
  EXPECT_GT(full, 1U);
  EXPECT_GT(deltas, 2 * full);
}

TEST_F(ServerNodeTest, GoesOnFromItsStoreAsIfNothingHadHappened) {
  fill();
  now_ = Timestamp{} + 20.0;
  const Step updated = done(node_->on_timer(now_));
  const auto nodes = node_->map_server().map().nodes;
  const auto verdicts = node_->map_server().state().verdicts;
  const auto refusals = node_->map_server().refusals();
  ASSERT_GT(verdicts.size(), 3U);
  ASSERT_EQ(refusals.size(), 1U);
  restart();
  EXPECT_TRUE(of_kind(resumed_, MessageKind::job).empty());
  EXPECT_EQ(of_kind(resumed_, MessageKind::receipt).size(), 2U);
  const auto sent = of_kind(updated, MessageKind::proxy_graph), again = of_kind(resumed_, MessageKind::proxy_graph);
  ASSERT_EQ(again.size(), 2U);
  EXPECT_EQ(*again[0].bytes, *sent[0].bytes);  // the same revision of the same epoch
  EXPECT_EQ(node_->next_timer(), std::nullopt);
  ASSERT_EQ(node_->map_server().map().nodes.size(), nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    EXPECT_EQ(node_->map_server().map().nodes[i].T_world_body, nodes[i].T_world_body);
  EXPECT_EQ(node_->map_server().state().verdicts, verdicts);
  EXPECT_EQ(node_->map_server().refusals(), refusals);

  receive(test::submap(kAlpha, 9));
  restart();
  EXPECT_TRUE(of_kind(resumed_, MessageKind::proxy_graph).empty());  // there is news: the next revision comes first
  EXPECT_EQ(node_->next_timer(), now_ + 0.5);                        // after the update before the restart
  EXPECT_EQ(pairs_of(resumed_).size(), 8U);
  now_ = now_ + 0.5;
  done(node_->on_timer(now_));
  EXPECT_EQ(node_->broadcast().age(), (std::pair<std::uint64_t, std::uint64_t>(1001, 2)));
}

TEST_F(ServerNodeTest, AsksAgainUntilItIsAnswered) {
  receive(test::submap(kAlpha, 0));
  receive(test::submap(kAlpha, 1));
  const Step asked = receive(test::submap(kAlpha, 2));
  EXPECT_EQ(pairs_of(asked).size(), 2U);
  restart();
  EXPECT_EQ(pairs_of(resumed_).size(), 3U);
  for (const auto& job : of_kind(resumed_, MessageKind::job))
    for (const auto& old : of_kind(asked, MessageKind::job)) EXPECT_NE(job.id, old.id);  // or a broker would drop it
  answer(asked, 0);                                                                      // of another start
  restart();
  EXPECT_EQ(pairs_of(resumed_).size(), 3U);
  answer(resumed_);
  answer(resumed_, 0);  // twice
  const server::RefusalCounts counts = node_->map_server().refusals();
  restart();
  EXPECT_TRUE(of_kind(resumed_, MessageKind::job).empty());
  EXPECT_EQ(node_->map_server().refusals(), counts);
  EXPECT_EQ(counts.at(RefusalReason::overlap).intra, 2U);
}

TEST_F(ServerNodeTest, AsksAgainWhatNobodyAnswersEveryTimeLater) {
  receive(test::submap(kAlpha, 0));
  const Step asked = receive(test::submap(kBravo, 0));
  const SubmapPair pair{{kAlpha, 0}, {kBravo, 0}};
  ASSERT_EQ(pairs_of(asked), std::set<SubmapPair>{pair});
  done(node_->on_timer(*node_->next_timer()));  // the map
  std::set<std::string> ids{of_kind(asked, MessageKind::job)[0].id};
  for (const double wait_s : {600.0, 1200.0, 2400.0}) {
    ASSERT_EQ(node_->next_timer(), now_ + wait_s);
    EXPECT_TRUE(done(node_->on_timer(now_ + wait_s - 0.1)).messages.empty());
    now_ = now_ + wait_s;
    const Step again = done(node_->on_timer(now_));
    EXPECT_EQ(pairs_of(again), std::set<SubmapPair>{pair});
    EXPECT_EQ(reported<VerificationFailed>(again), 1U);
    EXPECT_TRUE(of_kind(again, MessageKind::proxy_graph).empty());
    EXPECT_TRUE(ids.insert(of_kind(again, MessageKind::job)[0].id).second);  // or a broker would drop it
    EXPECT_EQ(node_->mission_status(now_).pending_jobs, 1U);
  }
  answer(asked);  // the first one, after all
  now_ = *node_->next_timer();
  done(node_->on_timer(now_));  // the map
  now_ = *node_->next_timer();
  EXPECT_TRUE(done(node_->on_timer(now_)).messages.empty());
  EXPECT_EQ(node_->next_timer(), std::nullopt);
  EXPECT_EQ(node_->mission_status(now_).pending_jobs, 0U);
}

TEST_F(ServerNodeTest, AJobThatWaitsBehindOthersIsNotAskedAgain) {
  std::vector<Step> asked;
  for (std::uint32_t i = 0; i < 4; ++i) asked.push_back(receive(test::submap(kAlpha, i)));
  done(node_->on_timer(*node_->next_timer()));
  now_ = now_ + 500.0;
  answer(asked[1]);
  if (const auto map = node_->next_timer(); map && *map < now_ + 50.0) done(node_->on_timer(*map));
  EXPECT_EQ(node_->next_timer(), now_ + 600.0);
  now_ = now_ + 500.0;
  answer(asked[3]);  // the one before it had its turn
  if (const auto map = node_->next_timer(); map && *map < now_ + 50.0) done(node_->on_timer(*map));
  EXPECT_EQ(node_->next_timer(), now_ + 100.0);
  EXPECT_EQ(pairs_of(done(node_->on_timer(now_ + 100.0))), pairs_of(asked[2]));
}

TEST_F(ServerNodeTest, AnOperatorsDecisionIsStoredAndSurvivesEveryRestart) {
  fill();
  now_ = Timestamp{} + 20.0;
  done(node_->on_timer(now_));
  const auto accepted = [&] {
    return std::ranges::count_if(node_->map_server().map().closures, &server::JudgedClosure::accepted);
  };
  const auto all = accepted();
  const SubmapPair pair{{kAlpha, 0}, {kBravo, 2}};
  const Step step = receive(test::envelope(ClosureDecision{"0/0-1/2", Wish::reject, "ada", 5}));
  EXPECT_EQ(reported<DecisionTaken>(step), 1U);
  ASSERT_EQ(node_->next_timer(), now_ + 0.5);
  for (int start = 0; start < 2; ++start) {
    restart();
    ASSERT_EQ(node_->map_server().state().decisions.size(), 1U);
    EXPECT_EQ(node_->map_server().state().decisions.at(pair), (ClosureDecision{"0/0-1/2", Wish::reject, "ada", 5}));
    ASSERT_EQ(node_->next_timer(), now_ + 0.5);  // the map has not followed yet
  }
  now_ = now_ + 0.5;
  done(node_->on_timer(now_));
  EXPECT_EQ(accepted(), all - 1);
  restart();
  EXPECT_EQ(node_->next_timer(), std::nullopt);
  EXPECT_EQ(accepted(), all - 1);

  const auto before = store_->tables();  // late, and once more
  EXPECT_EQ(reported<DecisionTaken>(receive(test::envelope(ClosureDecision{"0/0-1/2", Wish::accept, "eve", 4}))), 0U);
  EXPECT_EQ(reported<DecisionTaken>(receive(test::envelope(ClosureDecision{"0/0-1/2", Wish::reject, "ada", 5}))), 0U);
  EXPECT_EQ(store_->tables(), before);
  receive(test::envelope(ClosureDecision{"1/2-0/0", Wish::withdraw, "ada", 6}));
  restart();
  now_ = now_ + 0.5;
  done(node_->on_timer(now_));
  EXPECT_EQ(accepted(), all);
}

/// The operator's clock is a year ahead.
TEST_F(ServerNodeTest, ADecisionCountsFromWhenItCameAndNotFromAClockThatIsAhead) {
  fill();
  const SubmapPair pair{{kAlpha, 0}, {kBravo, 2}};
  const ClosureDecision ahead{"0/0-1/2", Wish::reject, "ada", 1'000'000}, right{"0/0-1/2", Wish::accept, "eve", 101};
  const auto holds = [&] { return node_->map_server().state().decisions.at(pair); };
  std::int64_t wall_ns = 100;
  start({RobotId{0}, RobotId{1}}, {.wall_ns = [&] { return wall_ns; }});
  const bus::Envelope liar = test::envelope(ahead);
  receive(liar);
  EXPECT_EQ(holds().by, "ada");
  EXPECT_EQ(holds().given_ns, 1'000'000) << "both times are stored";
  EXPECT_EQ(holds().taken_ns, 100);
  wall_ns = 102;
  EXPECT_EQ(reported<DecisionTaken>(receive(test::envelope(right))), 1U);
  EXPECT_EQ(holds().by, "eve");
  receive(liar);  // a bus may bring it again
  EXPECT_EQ(holds().by, "eve");
  receive(test::envelope(ClosureDecision{"0/0-1/2", Wish::withdraw, "ada", 99}));  // late, and not of a wrong clock
  EXPECT_EQ(holds().wish, Wish::accept);
}

TEST_F(ServerNodeTest, NobodyElseDecidesAndNotOnWhatIsNotThere) {
  fill();
  const auto before = store_->tables();
  const ClosureDecision decision{"0/0-1/2", Wish::reject, "ada", 5};
  for (const Endpoint from : {Endpoint::of(RobotId{0}), Endpoint::worker(0)}) {
    bus::Envelope forged = test::envelope(decision);
    forged.from = from;
    EXPECT_EQ(reported<MessageRefused>(receive(forged)), 1U);
  }
  bus::Envelope garbage = test::envelope(decision);
  garbage.bytes = std::make_shared<const std::string>("garbage");
  EXPECT_EQ(reported<MessageRefused>(receive(garbage)), 1U);
  for (const char* closure : {"nobody/0-1/2", "0/0-1/99", "0/0", "0/0-0/0"})
    EXPECT_EQ(reported<MessageRefused>(receive(test::envelope(ClosureDecision{closure, Wish::reject, "ada", 5}))), 1U)
        << closure;
  EXPECT_EQ(reported<MessageRefused>(receive(test::envelope(ClosureDecision{"0/0-1/1", Wish::accept, "ada", 5}))),
            1U);  // no closure there
  EXPECT_EQ(store_->tables(), before);
}

TEST_F(ServerNodeTest, TheMapSaysWhoVerifiedAClosureAndWhenButTheServerDoesNotCare) {
  receive(test::submap(kAlpha, 0));
  const Step asked = receive(test::submap(kBravo, 0));
  WorkerNode worker(Endpoint::worker(4), verifier_, SubmapFrames::of(*store_));
  worker.set_clock([] { return std::int64_t{1'700'000'000'000'000'000}; });
  for (const auto& job : of_kind(asked, MessageKind::job))
    for (const auto& verdicts : worker.receive(job, now_).messages) receive(verdicts);
  const SubmapPair pair{{kAlpha, 0}, {kBravo, 0}};
  const auto row = wire::decode_verdict(store_->tables().at("verdicts").at(key_of(pair)));
  ASSERT_TRUE(row.has_value());
  EXPECT_EQ(row->worker, 1U + 4U);
  EXPECT_EQ(row->verified_ns, 1'700'000'000'000'000'000);
  EXPECT_EQ(row->verifier, verifier_->id());
  const auto verdicts = node_->map_server().state().verdicts;
  EXPECT_EQ(verdicts.at(pair).worker, 0U);
  restart();
  EXPECT_EQ(node_->map_server().state().verdicts, verdicts);
}

/// Counts what is read of another.
class CountingStore final : public storage::TableStore {
 public:
  explicit CountingStore(const storage::TableStore& rows) : rows_(rows) {}
  Status commit(std::span<const storage::Write>) override { return fail(ErrorCode::io, "nothing is written here"); }
  [[nodiscard]] Result<std::optional<std::string>> read(std::string_view table, std::string_view key) const override {
    ++read_[std::string(table)];
    return rows_.read(table, key);
  }
  [[nodiscard]] Status scan(std::string_view table, std::string_view from, const Visit& visit) const override {
    return rows_.scan(table, from, [&](std::string_view key, std::string_view bytes) {
      ++scanned_[std::string(table)];
      return visit(key, bytes);
    });
  }
  [[nodiscard]] Status sizes(std::string_view table, const VisitSize& visit) const override {
    return rows_.sizes(table, visit);
  }
  mutable std::map<std::string, std::size_t> read_, scanned_;

 private:
  const storage::TableStore& rows_;
};

TEST_F(ServerNodeTest, ItIsReadyBeforeTheMapIsComputedAndSaysWhatTheStoreKnows) {
  fill();
  now_ = Timestamp{} + 20.0;
  done(node_->on_timer(now_));
  const auto before = node_->mission_status(now_);
  ASSERT_GT(before.closures, 0U);
  const CountingStore store(*store_);
  const auto again = std::move(ServerNode::open({RobotId{0}, RobotId{1}}, verifier_, {}, 1, store).value());
  const Step first = again->resume(now_);
  EXPECT_EQ(of_kind(first, MessageKind::receipt).size(), 2U);
  EXPECT_TRUE(of_kind(first, MessageKind::proxy_graph).empty());
  EXPECT_EQ(store.read_["submaps"], 0U);
  EXPECT_EQ(store.scanned_["submaps"], 8U);  // each once, and no cloud is decoded (wire::decode_outline)
  EXPECT_FALSE(again->has_map());
  EXPECT_TRUE(again->map_server().map().nodes.empty());
  EXPECT_EQ(again->mission_status(now_).closures, before.closures);
  EXPECT_EQ(again->mission_status(now_).components, before.components);
  EXPECT_EQ(again->mission_status(now_).submaps, before.submaps);
  EXPECT_FALSE(again->mission_status(now_).has_news);

  ASSERT_EQ(again->next_timer(), now_);
  const Step second = again->on_timer(now_);
  EXPECT_EQ(of_kind(second, MessageKind::proxy_graph).size(), 2U);
  EXPECT_TRUE(again->has_map());
  EXPECT_EQ(again->map_server().state().revision, node_->map_server().state().revision);
  EXPECT_EQ(again->map_server().map().nodes.size(), node_->map_server().map().nodes.size());
  EXPECT_EQ(again->next_timer(), std::nullopt);
}

TEST_F(ServerNodeTest, WhatComesBeforeTheMapIsComputedIsInTheFirstOne) {
  fill();
  now_ = Timestamp{} + 20.0;
  done(node_->on_timer(now_));
  const auto again = std::move(ServerNode::open({RobotId{0}, RobotId{1}}, verifier_, {}, 1, *store_).value());
  now_ = now_ + 1.0;
  done(again->resume(now_));
  const Step step = done(again->receive(test::envelope(test::submap(kAlpha, 9)), now_));
  EXPECT_EQ(of_kind(step, MessageKind::receipt).size(), 1U);
  EXPECT_EQ(again->next_timer(), now_);  // an update as any other
  const Step update = done(again->on_timer(*again->next_timer()));
  EXPECT_EQ(reported<MapUpdated>(update), 1U);
  EXPECT_EQ(of_kind(update, MessageKind::proxy_graph).size(), 2U);
  EXPECT_EQ(again->map_server().state().revision, node_->map_server().state().revision + 1);
  EXPECT_NE(find_node(again->map_server().map(), {kAlpha, 27}), nullptr);
}

TEST_F(ServerNodeTest, AStoreThatIsDamagedIsNoMap) {
  fill();
  receive(test::envelope(ClosureDecision{"0/0-1/2", Wish::reject, "ada", 5}));
  for (const auto& [table, rows] : store_->tables()) {
    if (rows.empty()) continue;
    auto tables = store_->tables();
    tables.at(table).begin()->second.pop_back();
    const storage::MemoryStore damaged(storage::map_schema(), tables);
    const auto opened = ServerNode::open({RobotId{0}, RobotId{1}}, verifier_, {}, 1, damaged);
    ASSERT_FALSE(opened.has_value()) << table;
    EXPECT_NE(opened.error().message.find("map"), std::string::npos) << opened.error().message;
  }
}

/// Finds that odometry lost a metre in the middle.
class LostMetreVerifier final : public server::ClosureVerifier {
 public:
  [[nodiscard]] MethodId id() const override { return even_.id(); }
  [[nodiscard]] std::string settings() const override { return even_.settings(); }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
    return even_.can_compare(first, second);
  }
  [[nodiscard]] bool is_candidate(const Submap&, const Submap&) const override { return true; }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override {
    auto verdict = even_.verify(first, second, payloads);
    for (LoopClosure& closure : verdict->closures)
      if (first.id.index < kMiddle && second.id.index >= kMiddle) closure.measurement.T_a_b.translation.x() += 1.0;
    return verdict;
  }

 private:
  static constexpr std::uint32_t kMiddle = 8;
  test::EvenVerifier even_;
};

class ChangedMap : public ServerNodeTest {
 protected:
  /// The next update changes its mind.
  void reach() {
    verifier_ = std::make_shared<LostMetreVerifier>();
    start({RobotId{0}}, {.pairs_per_job = 1000});
    std::vector<Step> jobs;
    for (std::uint32_t i = 0; i < 18; ++i) jobs.push_back(receive(test::submap(kAlpha, i)));
    now_ = *node_->next_timer();
    EXPECT_EQ(of_kind(done(node_->on_timer(now_)), MessageKind::proxy_graph).size(), 1U);
    for (const Step& step : jobs) answer(step);
    now_ = *node_->next_timer();
  }
};

TEST_F(ChangedMap, IsSentAtOnceAndReported) {
  reach();
  const Step changed = done(node_->on_timer(now_));
  const auto graphs = of_kind(changed, MessageKind::proxy_graph);
  ASSERT_EQ(graphs.size(), 1U);
  EXPECT_EQ(wire::decode_proxy_graph(*graphs[0].bytes)->graph.nodes.size(), node_->broadcast().nodes.size());
  EXPECT_EQ(reported<ChangeOfMind>(changed), 1U);
  EXPECT_EQ(node_->next_timer(), std::nullopt);
}

TEST_F(ChangedMap, IsSentAtOnceAfterAnOperatorsDecision) {
  reach();
  const auto& verdicts = node_->map_server().state().verdicts;
  ASSERT_FALSE(verdicts.empty());
  const std::string name = server::ClosureNames({}, {kAlpha}).of(verdicts.begin()->first);
  const Step heard = receive(test::envelope(ClosureDecision{name, Wish::accept, "ada", 5}));
  EXPECT_EQ(reported<DecisionTaken>(heard), 1U);
  const Step changed = done(node_->on_timer(now_));
  EXPECT_EQ(of_kind(changed, MessageKind::proxy_graph).size(), 1U);
}

}  // namespace server_node_test
}  // namespace tutti::node
