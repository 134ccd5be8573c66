// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/host.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/node/submaps.hpp"
#include "support/program/full_disk.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::program {
namespace host_test {

using bus::Endpoint;
using bus::MessageKind;

/// The events in order, as all of the parts below note them.
using Diary = std::vector<std::string>;

class DiaryStore final : public test::FullDisk {
 public:
  explicit DiaryStore(Diary& diary) : FullDisk({"test", 1, {"rows", "meta"}}), diary_(diary) {}
  Status commit(std::span<const storage::Write> writes) override {
    if (!full) diary_.push_back("commit " + std::to_string(writes.size()));
    return FullDisk::commit(writes);
  }

 private:
  Diary& diary_;
};

/// Messages that have come and are not acknowledged, whatever ports come and go.
struct Mail {
  std::map<std::uint64_t, bus::Envelope> owed;
  ErrorCode refuses_with{};
  bool refuses = false;
};

class DiaryPort final : public bus::Port {
 public:
  DiaryPort(Diary& diary, Mail& mail) : diary_(diary), mail_(mail), untaken_(mail.owed) {}
  Status send(bus::Envelope envelope) override {
    if (mail_.refuses) return tl::unexpected(Error{mail_.refuses_with, "no"});
    diary_.push_back("send " + *envelope.bytes);
    return {};
  }
  std::vector<bus::Received> receive() override {
    std::vector<bus::Received> all;
    for (const auto& [ticket, envelope] : std::exchange(untaken_, {})) all.push_back({envelope, ticket});
    return all;
  }
  void acknowledge(std::uint64_t ticket) override {
    diary_.push_back("acknowledge " + std::to_string(ticket));
    mail_.owed.erase(ticket);
  }
  void still_busy(std::uint64_t) override {}

 private:
  Diary& diary_;
  Mail& mail_;
  std::map<std::uint64_t, bus::Envelope> untaken_;
};

bus::Envelope letter(MessageKind kind, const std::string& text) {
  return {Endpoint::server(), Endpoint::of(RobotId{1}), kind, "", std::make_shared<const std::string>(text)};
}

/// Writes down and passes on whatever comes; works every second.
class Postman final : public Hosted {
 public:
  explicit Postman(const std::function<void()>& waits) : waits_(waits) {}
  void wait(double) override { waits_(); }
  Answer end() override { return {{.writes = {{"rows", "end", "goodbye"}}}, {}}; }
  Answer start(Timestamp) override { return {{.messages = {letter(MessageKind::job, "hello")}}, {}}; }
  Answer receive(const bus::Received& message, Timestamp) override {
    if (*message.envelope.bytes == "poison") throw std::out_of_range("poisoned");
    takes();
    return {{.writes = {{"rows", std::to_string(message.ticket), *message.envelope.bytes}},
             .messages = {letter(MessageKind::job, *message.envelope.bytes)}},
            {message.ticket}};
  }
  Answer put_aside(const bus::Received& message, const std::string& why, Timestamp) override {
    EXPECT_NE(why.find(PutAside::hash_of(message.envelope)), std::string::npos) << why;
    return {{.messages = {letter(MessageKind::job, "refused")}}, {message.ticket}};
  }
  [[nodiscard]] std::optional<Timestamp> next_work() const override { return Timestamp{} + next_s_; }
  Answer work(Timestamp) override {
    if (work_throws) throw std::logic_error("cannot work");
    next_s_ += 1.0;
    return {{.messages = {letter(MessageKind::job, "work")}}, {}};
  }
  Answer report(Timestamp) override {
    if (report_throws) throw 42;
    return {{.messages = {letter(MessageKind::status, "report")}}, {}};
  }
  [[nodiscard]] Json status(Timestamp) const override { return {{"line", "fine"}}; }
  static inline bool work_throws = false, report_throws = false;
  static inline std::function<void()> takes;

 private:
  const std::function<void()>& waits_;
  double next_s_ = 10.0;
};

class HostTest : public testing::Test {
 protected:
  HostTest() {
    Postman::work_throws = Postman::report_throws = false;
    Postman::takes = [] {};
    host_ = host("1");
  }
  std::unique_ptr<Host> host(const std::string& version) {
    Host::Parts parts;
    parts.table_aside = "meta";
    parts.version = version;
    parts.store = &store_;
    parts.open_port = [this]() -> Result<std::unique_ptr<bus::Port>> {
      return std::make_unique<DiaryPort>(diary_, mail_);
    };
    parts.open_node = [this](bus::Port&) -> Result<std::unique_ptr<Hosted>> {
      return std::make_unique<Postman>(waits_);
    };
    return std::make_unique<Host>(std::move(parts), clock_, *log_);
  }
  /// Turns, with time to be made again in between.
  Diary turns(int count) {
    for (int i = 0; i < count; ++i, wall_s_ += 1.01 * Host::kReopen_s) host_->turn();
    return take_diary();
  }
  [[nodiscard]] std::size_t rows_aside() const {
    std::size_t rows = 0;
    EXPECT_TRUE(store_.scan("meta", "aside/", [&](auto, auto) { return ++rows > 0; }).has_value());
    return rows;
  }
  Diary take_diary() { return std::exchange(diary_, {}); }

  double wall_s_ = 0.0;
  Clock clock_{2.0, 0.0, [this] { return wall_s_; }};
  std::unique_ptr<EventLog> log_ = EventLog::on_console("test", Level::error);
  Diary diary_;
  Mail mail_;
  DiaryStore store_{diary_};
  std::function<void()> waits_ = [] {};
  std::unique_ptr<Host> host_;
};

TEST_F(HostTest, CommitsThenSendsThenAcknowledges) {
  mail_.owed = {{1, letter(MessageKind::submap, "a")}, {2, letter(MessageKind::submap, "b")}};
  ASSERT_TRUE(host_->open().has_value());
  EXPECT_EQ(take_diary(), Diary{"send hello"});
  host_->turn();
  EXPECT_EQ(take_diary(), (Diary{"commit 2", "send a", "send b", "acknowledge 1", "acknowledge 2", "send report"}));
  EXPECT_EQ(host_->traffic().at({false, MessageKind::submap}).messages, 2U);
  EXPECT_EQ(host_->traffic().at({true, MessageKind::job}).bytes, std::string("helloab").size());
}

TEST_F(HostTest, WorksWhenItIsTimeAndNotBefore) {
  ASSERT_TRUE(host_->open().has_value());
  host_->turn();
  wall_s_ = 4.99;  // mission time 9.98
  EXPECT_NEAR(host_->turn(), 0.01, 1e-6);
  EXPECT_EQ(std::ranges::count(take_diary(), "send work"), 0);
  wall_s_ = 5.0;
  host_->turn();
  EXPECT_EQ(std::ranges::count(take_diary(), "send work"), 1);
  host_->turn();
  EXPECT_EQ(std::ranges::count(take_diary(), "send work"), 0);
}

TEST_F(HostTest, ManySlowMessagesDoNotKeepItFromItsWork) {
  Postman::takes = [this] { wall_s_ += 0.1; };
  for (std::uint64_t ticket = 1; ticket <= 30; ++ticket) mail_.owed[ticket] = letter(MessageKind::job, "slow");
  host_ = host("1");
  ASSERT_TRUE(host_->open().has_value());
  wall_s_ = 100.0;
  take_diary();
  EXPECT_EQ(host_->turn(), 0.0);  // there is more to take
  const Diary first = take_diary();
  EXPECT_EQ(std::ranges::count(first, "send work"), 1);
  EXPECT_EQ(std::ranges::count(first, "acknowledge 3"), 1);
  EXPECT_EQ(std::ranges::count(first, "acknowledge 4"), 0);
  for (int i = 0; i < 20 && host_->turn() == 0.0; ++i) {
  }
  EXPECT_TRUE(mail_.owed.empty());
  const Diary rest = take_diary();
  EXPECT_EQ(std::ranges::count(rest, "acknowledge 3"), 0);
  EXPECT_EQ(std::ranges::count(rest, "acknowledge 30"), 1);
}

TEST_F(HostTest, MessagesThatWaitComeAgainWhenTheNodeIsMadeAnew) {
  Postman::takes = [this] { wall_s_ += 0.3; };
  for (std::uint64_t ticket = 1; ticket <= 5; ++ticket) mail_.owed[ticket] = letter(MessageKind::job, "slow");
  host_ = host("1");
  ASSERT_TRUE(host_->open().has_value());
  host_->turn();
  store_.full = true;
  host_->turn();
  store_.full = false;
  take_diary();
  turns(8);
  EXPECT_TRUE(mail_.owed.empty());
  std::size_t rows = 0;
  EXPECT_TRUE(store_.scan("rows", "", [&](auto, auto) { return ++rows > 0; }).has_value());
  EXPECT_EQ(rows, 5U);
}

TEST_F(HostTest, WhatCannotBeCommittedIsNeitherSentNorAcknowledgedAndComesAgain) {
  ASSERT_TRUE(host_->open().has_value());
  mail_.owed = {{7, letter(MessageKind::submap, "a")}};
  store_.full = true;
  ASSERT_TRUE(host_->open().has_value());  // a port that has the letter
  take_diary();
  host_->turn();
  EXPECT_EQ(take_diary(), Diary{});
  EXPECT_EQ(host_->hosted(), nullptr);
  wall_s_ += 0.9 * Host::kReopen_s;
  store_.full = false;
  host_->turn();
  EXPECT_EQ(host_->hosted(), nullptr);
  wall_s_ += 0.2 * Host::kReopen_s;
  host_->turn();  // opens
  host_->turn();
  const Diary after = take_diary();
  EXPECT_EQ((Diary{after.begin(), after.begin() + 4}), (Diary{"send hello", "commit 1", "send a", "acknowledge 7"}));
  EXPECT_TRUE(mail_.owed.empty());
  EXPECT_EQ(*store_.read("rows", "7").value(), "a");
}

TEST_F(HostTest, WhatThePortRefusesWaitsInItsOrder) {
  ASSERT_TRUE(host_->open().has_value());
  mail_ = {.owed = {{1, letter(MessageKind::submap, "a")}, {2, letter(MessageKind::submap, "b")}},
           .refuses_with = ErrorCode::io,
           .refuses = true};
  ASSERT_TRUE(host_->open().has_value());
  host_->turn();
  take_diary();
  host_->turn();
  EXPECT_EQ(take_diary(), Diary{});
  mail_.refuses = false;
  host_->turn();
  EXPECT_EQ(take_diary(), (Diary{"send hello", "send a", "send b"}));  // the report is too old by now
}

TEST_F(HostTest, WhatCanNeverBeSentDoesNotWait) {
  mail_ = {.owed = {{1, letter(MessageKind::submap, "a")}}, .refuses_with = ErrorCode::invalid, .refuses = true};
  ASSERT_TRUE(host_->open().has_value());
  host_->turn();
  mail_.refuses = false;
  take_diary();
  host_->turn();
  EXPECT_EQ(take_diary(), Diary{});
}

TEST_F(HostTest, AMessageThatMakesTheNodeThrowIsPutAsideAndAllElseGoesOn) {
  mail_.owed = {{1, letter(MessageKind::submap, "a")},
                {2, letter(MessageKind::submap, "poison")},
                {3, letter(MessageKind::submap, "b")}};
  ASSERT_TRUE(host_->open().has_value());
  EXPECT_EQ(turns(1), (Diary{"send hello", "commit 1", "send a", "acknowledge 1"}));  // what came before it counts
  EXPECT_EQ(host_->hosted(), nullptr);                                                // nobody knows how it stands
  EXPECT_EQ(rows_aside(), 0U);
  for (unsigned throws = 1; throws < PutAside::kMostThrows; ++throws) turns(2);  // is made again; throws again
  EXPECT_EQ(rows_aside(), 1U);
  const Diary after = turns(2);
  EXPECT_EQ((Diary{after.begin(), after.begin() + 6}),
            (Diary{"send hello", "commit 1", "send refused", "send b", "acknowledge 2", "acknowledge 3"}));
  EXPECT_TRUE(mail_.owed.empty());

  mail_.owed = {{4, letter(MessageKind::submap, "poison")}};  // it is known, also after a restart,
  host_ = host("1");
  ASSERT_TRUE(host_->open().has_value());
  turns(1);
  EXPECT_NE(host_->hosted(), nullptr);
  EXPECT_TRUE(mail_.owed.empty());
  mail_.owed = {{5, letter(MessageKind::submap, "poison")}};  // and another version tries again
  host_ = host("2");
  ASSERT_TRUE(host_->open().has_value());
  turns(1);
  EXPECT_EQ(host_->hosted(), nullptr);
  EXPECT_FALSE(mail_.owed.empty());
}

TEST_F(HostTest, AJobThatMakesTheNodeThrowIsLeftToTheBus) {
  mail_.owed = {{1, letter(MessageKind::job, "poison")}};
  ASSERT_TRUE(host_->open().has_value());
  turns(4 * static_cast<int>(PutAside::kMostThrows));
  EXPECT_EQ(mail_.owed.size(), 1U);
  EXPECT_EQ(rows_aside(), 0U);
}

TEST_F(HostTest, AStatusIsPutAsideByItsSender) {
  bus::Envelope status = letter(MessageKind::status, "poison");
  bus::Envelope next = letter(MessageKind::status, "fine");
  EXPECT_EQ(PutAside::hash_of(status), PutAside::hash_of(next));
  next.from = Endpoint::of(RobotId{2});
  EXPECT_NE(PutAside::hash_of(status), PutAside::hash_of(next));
  bus::Envelope submap = letter(MessageKind::submap, "a");
  EXPECT_NE(PutAside::hash_of(submap), PutAside::hash_of(letter(MessageKind::submap, "b")));
  submap.id = "1";
  EXPECT_NE(PutAside::hash_of(submap), PutAside::hash_of(letter(MessageKind::submap, "a")));
}

TEST_F(HostTest, WorkThatThrowsWaitsLongerEveryTimeWhileMessagesAreTaken) {
  Postman::work_throws = true;
  ASSERT_TRUE(host_->open().has_value());
  wall_s_ = 5.0;
  std::size_t tries = 0;
  for (int i = 0; i < 200; ++i, wall_s_ += 1.0) {
    const bool was_there = host_->hosted() != nullptr;
    mail_.owed = {{1, letter(MessageKind::submap, "a")}};
    EXPECT_GT(host_->turn(), 0.0);
    if (was_there && host_->hosted() == nullptr) ++tries;
  }
  EXPECT_GE(tries, 4U);
  EXPECT_LE(tries, 6U);                                                                    // after 6, 12, 24, 48, 96 s
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(take_diary(), "send a")), tries);  // whenever it is made again
  EXPECT_NE(host_->trouble().find("cannot work"), std::string::npos) << host_->trouble();
  Postman::work_throws = false;
  for (int i = 0; i < 200; ++i, wall_s_ += 1.0) host_->turn();
  EXPECT_GT(std::ranges::count(take_diary(), "send work"), 0);
  EXPECT_EQ(host_->trouble(), "");
}

TEST_F(HostTest, AReportThatThrowsEndsNothing) {
  Postman::report_throws = true;
  ASSERT_TRUE(host_->open().has_value());
  turns(1);
  mail_.owed = {{1, letter(MessageKind::submap, "a")}};
  turns(3);
  EXPECT_TRUE(mail_.owed.empty());
}

TEST_F(HostTest, WhatIsThrownWhileItWaitsOrEndsEndsNothing) {
  std::atomic<bool> stop = false;
  waits_ = [&] {
    stop = true;
    throw std::runtime_error("fed something strange");
  };
  ASSERT_TRUE(host_->open().has_value());
  host_->run(stop);
  EXPECT_EQ(host_->hosted(), nullptr);
  wall_s_ += Host::kReopen_s;
  host_->turn();
  EXPECT_NE(host_->hosted(), nullptr);
  Postman::report_throws = true;
  host_->run(stop);
}

/// A mapping server whose verifier throws when it is asked for submap 0/7/1.
class Mapper final : public Hosted {
 public:
  class Verifier final : public server::ClosureVerifier {
   public:
    [[nodiscard]] MethodId id() const override { return there_.id(); }
    [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
      return there_.can_compare(first, second);
    }
    [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
      for (const Submap* submap : {&first, &second})
        if (submap->id == SubmapId{{RobotId{0}, 7}, 1}) throw std::out_of_range("map::at");
      return there_.is_candidate(first, second);
    }
    [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                                const server::PayloadStore& payloads) const override {
      return there_.verify(first, second, payloads);
    }

   private:
    node::test::EvenVerifier there_;
  };
  explicit Mapper(const storage::TableStore& store)
      : node_(std::move(
            node::ServerNode::open({RobotId{0}}, std::make_shared<Verifier>(), node::ServerNodeConfig{}, 1, store)
                .value())) {}
  Answer start(Timestamp now) override { return {node_->resume(now), {}}; }
  Answer receive(const bus::Received& message, Timestamp now) override {
    return {node_->receive(message.envelope, now), {message.ticket}};
  }
  Answer put_aside(const bus::Received& message, const std::string& why, Timestamp now) override {
    return {node_->put_aside(message.envelope, why, now), {message.ticket}};
  }
  [[nodiscard]] Json status(Timestamp now) const override {
    const MissionStatus status = node_->mission_status(now);
    return {{"submaps", status.submaps}, {"refused", status.refusals.size()}};
  }

 private:
  std::unique_ptr<node::ServerNode> node_;
};

TEST_F(HostTest, AServerWhoseVerifierThrowsOnOneSubmapMapsTheOthers) {
  storage::MemoryStore store(storage::map_schema());
  Host host(
      {.store = &store,
       .open_port = [this]() -> Result<std::unique_ptr<bus::Port>> {
         return std::make_unique<DiaryPort>(diary_, mail_);
       },
       .open_node = [&](bus::Port&) -> Result<std::unique_ptr<Hosted>> { return std::make_unique<Mapper>(store); },
       .each_second = {},
       .status_file = {},
       .table_aside = "meta",
       .version = "1"},
      clock_, *log_);
  for (std::uint32_t i = 0; i < 4; ++i)
    mail_.owed.emplace(i, node::test::envelope(node::test::submap({RobotId{0}, 7}, i)));
  ASSERT_TRUE(host.open().has_value());
  for (int i = 0; i < 10; ++i, wall_s_ += 1.01 * Host::kReopen_s) host.turn();
  EXPECT_TRUE(mail_.owed.empty());
  ASSERT_NE(host.hosted(), nullptr);
  EXPECT_EQ(host.hosted()->status(clock_.now()), (Json{{"submaps", 3}, {"refused", 1}}));
  EXPECT_EQ(store.tables().at("submaps").size(), 3U);
}

TEST_F(HostTest, ItsLastMessagesAreStored) {
  mail_.owed = {{1, letter(MessageKind::submap, "a")}};
  ASSERT_TRUE(host_->open().has_value());
  host_->turn();
  const std::atomic<bool> stop = true;
  host_->run(stop);
  host_.reset();
  EXPECT_TRUE(store_.read("rows", "1").value().has_value());
  EXPECT_TRUE(store_.read("rows", "end").value().has_value());
}

TEST_F(HostTest, CarriesOutWhatIsSentWhileItWaitsUntilThatCannotBeStored) {
  std::atomic<bool> stop = false;
  const auto carry_out = [&](const std::string& text) {
    return host_->carry_out({.writes = {{"rows", text, text}}, .messages = {letter(MessageKind::job, text)}});
  };
  waits_ = [&] {
    take_diary();
    EXPECT_TRUE(carry_out("a").has_value());
    EXPECT_EQ(take_diary(), (Diary{"commit 1", "send a"}));
    store_.full = true;
    EXPECT_FALSE(carry_out("b").has_value());
    store_.full = false;
    EXPECT_FALSE(carry_out("c").has_value());  // may rest on b
    EXPECT_NE(host_->hosted(), nullptr);       // it is in the middle of wait()
    EXPECT_EQ(take_diary(), Diary{});
    stop = true;
  };
  ASSERT_TRUE(host_->open().has_value());
  host_->run(stop);
  EXPECT_EQ(host_->hosted(), nullptr);
  wall_s_ += Host::kReopen_s;
  host_->turn();
  EXPECT_EQ(take_diary(), Diary{"send hello"});
  EXPECT_TRUE(carry_out("d").has_value());
}

}  // namespace host_test
}  // namespace tutti::program
