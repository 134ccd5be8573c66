// SPDX-License-Identifier: BSD-3-Clause
// One server of a mission on a bus, and how the next one gets its place.
#include "tutti/bus/mission_lease.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <string>
#include <thread>

#include "support/bus/port_networks.hpp"
#include "support/bus/tcp_relay.hpp"

namespace tutti::bus {
namespace mission_lease_test {

using namespace std::chrono_literals;

constexpr std::uint64_t kNoProcess = 0x7fff'fff0;

class MissionLeases : public testing::TestWithParam<test::PortImplementation> {
 protected:
  void SetUp() override {
    if (GetParam().needs_nats) TUTTI_SKIP_WITHOUT_NATS_SERVER();
    network_ = GetParam().make();
    url_ = network_->url();
  }
  [[nodiscard]] std::unique_ptr<MissionLease> open(const std::string& mission, std::optional<LeaseHolder> self = {},
                                                   const LeaseTimes& times = kQuick) const {
    return MissionLease::open({.url = url_, .mission = mission}, std::move(self), times).value();
  }
  /// A process of another machine: nobody can know whether it has ended.
  static LeaseHolder holder(const std::string& state, std::uint64_t process) {
    return {.host = "base",
            .process = process,
            .state = state,
            .since_ns = 1'700'000'000'000'000'000,
            .seat = state,
            .mark = "elsewhere " + std::to_string(process)};
  }
  [[nodiscard]] std::unique_ptr<LeaseBoard> open_board() const {
    const BusOptions where{.url = url_};
    return transport_of(where).value()->open_leases(where);
  }
  /// Somebody puts a value in the place of a lease, as anybody can.
  void put(const std::string& mission, const std::string& text) const {
    const auto board = open_board();
    EXPECT_TRUE(comes([&] {
      const auto there = board->read(mission).value();
      return board->write(mission, {text, there ? there->revision : 0}, kQuick.lease_s).has_value();
    }));
  }
  [[nodiscard]] std::optional<LeaseHolder> written(const std::string& mission) const {
    const auto value = open_board()->read(mission).value();
    return value ? lease_of(value->text) : std::nullopt;
  }
  static constexpr LeaseTimes kQuick{.lease_s = 4.0, .renew_s = 0.2, .unrenewed_s = 1.0, .look_s = 0.5, .rest_s = 60.0};

  /// Until it is true, or for half a minute.
  template <class Condition>
  static bool comes(Condition&& condition) {
    const auto end = std::chrono::steady_clock::now() + 30s;
    while (!condition() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(20ms);
    return condition();
  }

  std::unique_ptr<test::PortNetwork> network_;
  std::string url_;
};
using MissionLeasesOverNats = MissionLeases;

const auto kName = [](const auto& of) { return std::string(of.param.name); };
INSTANTIATE_TEST_SUITE_P(Transports, MissionLeases, testing::ValuesIn(test::kTransports), kName);
INSTANTIATE_TEST_SUITE_P(Transports, MissionLeasesOverNats, testing::Values(test::kTransports[0]), kName);

TEST_P(MissionLeases, ValuesAreComparedAndSetAndExpire) {
  constexpr double kLasts_s = 1.0;
  const auto board = open_board(), other = open_board();
  EXPECT_FALSE(board->read("alps").value().has_value());
  EXPECT_TRUE(board->read_all().value().empty());
  ASSERT_TRUE(board->write("alps", {"first", 0}, kLasts_s));
  const auto first = other->read("alps").value().value();
  EXPECT_EQ(first.text, "first");
  EXPECT_FALSE(other->write("alps", {"second", 0}, kLasts_s));
  ASSERT_TRUE(other->write("alps", {"second", first.revision}, kLasts_s));
  EXPECT_FALSE(board->write("alps", {"third", first.revision}, kLasts_s));
  EXPECT_EQ(board->read_all().value().at("alps").text, "second");
  ASSERT_TRUE(board->write("jura", {"removed", 0}, kLasts_s));
  board->remove("jura");
  EXPECT_FALSE(board->read("jura").value().has_value());
  EXPECT_TRUE(comes([&] { return !board->read("alps").value().has_value(); }));
  EXPECT_TRUE(board->write("alps", {"fourth", 0}, kLasts_s));
}

TEST_P(MissionLeases, AreOfOneServerEach) {
  const LeaseHolder first = holder("/var/lib/a", 17);
  auto lease = open("alps", first);
  EXPECT_TRUE(lease->wait(10.0).held);
  const auto second = open("alps", holder("/var/lib/b", 18));
  const auto refused = second->wait(10.0);
  EXPECT_FALSE(refused.held);
  ASSERT_NE(refused.server_of("alps"), nullptr);
  EXPECT_EQ(*refused.server_of("alps"), first);
  EXPECT_EQ(to_string(first), "process 17 on base, state /var/lib/a, since 2023-11-14 22:13:20 UTC");
  EXPECT_TRUE(open("jura", holder("/var/lib/b", 18))->wait(10.0).held);
  lease.reset();  // in order: the place is free
  EXPECT_TRUE(comes([&] { return second->state().held; }));
}

TEST_P(MissionLeases, GoToTheSuccessorOnTheSameSeatAtOnceWhenTheFirstHasCertainlyEnded) {
  LeaseHolder self = holder("/var/lib/a", static_cast<std::uint64_t>(getpid())), first = self;
  self.mark = process_mark(1);
  first.mark = process_mark(2);
  first.process = kNoProcess;
  const auto made = open("jura", holder("/var/lib/b", 18));
  ASSERT_TRUE(made->wait(10.0).held);
  put("alps", lease_text(first));
  LeaseTimes patient = kQuick;
  patient.unrenewed_s = 1'000.0;  // nobody waits for this
  EXPECT_TRUE(open("alps", self, patient)->wait(20.0).held);
}

TEST_P(MissionLeases, GoToTheSuccessorOnTheSameSeatWhenTheFirstRenewsNoMore) {
  const auto made = open("jura", holder("/var/lib/b", 18));
  ASSERT_TRUE(made->wait(10.0).held);
  put("alps", lease_text(holder("/var/lib/a", 17)));
  const auto begin = std::chrono::steady_clock::now();
  const auto second = open("alps", holder("/var/lib/a", 99));
  EXPECT_TRUE(comes([&] { return !second->state().waits.empty(); }));
  EXPECT_NE(second->state().waits.find("process 17"), std::string::npos) << second->state().waits;
  EXPECT_TRUE(second->state().missions.empty());  // not known yet
  EXPECT_TRUE(comes([&] { return second->state().held; }));
  EXPECT_GT(std::chrono::steady_clock::now() - begin, 900ms);
}

// A state folder and its copy in two containers of one machine.
TEST_P(MissionLeases, AreOfOneOfTwoServersWithOneSeat) {
  const auto first = open("alps", holder("/state", 1));
  ASSERT_TRUE(first->wait(10.0).held);
  LeaseHolder copy = holder("/state", 1);
  copy.mark = "another container";
  const auto second = open("alps", copy);
  const auto refused = second->wait(10.0);
  EXPECT_FALSE(refused.held);
  EXPECT_NE(refused.server_of("alps"), nullptr);
  EXPECT_TRUE(first->state().held);
}

TEST_P(MissionLeases, AValueThatIsNoLeaseIsOverwritten) {
  const auto made = open("jura", holder("/var/lib/b", 18));
  ASSERT_TRUE(made->wait(10.0).held);
  put("alps", "x");
  EXPECT_EQ(served_mission({.url = url_, .mission = ""}, 10.0).value(), "jura");  // it is no server
  const auto lease = open("alps", holder("/var/lib/a", 17));
  EXPECT_TRUE(lease->wait(10.0).held);  // of a server that starts,
  put("alps", "x");
  EXPECT_TRUE(comes([&] { return written("alps").has_value(); }));  // and of one that runs
  EXPECT_TRUE(lease->state().held);
}

TEST_P(MissionLeases, AHolderTakesBackALeaseThatNobodyRenews) {
  const auto lease = open("alps", holder("/var/lib/a", 17));
  ASSERT_TRUE(lease->wait(10.0).held);
  put("alps", lease_text(holder("/var/lib/b", 18)));
  EXPECT_TRUE(comes([&] { return !lease->state().waits.empty(); }));
  EXPECT_TRUE(lease->state().held);
  EXPECT_EQ(lease->state().server_of("alps"), nullptr);
  EXPECT_TRUE(comes([&] { return written("alps") == holder("/var/lib/a", 17); }));
  EXPECT_TRUE(lease->state().held);
}

TEST_P(MissionLeases, AHolderYieldsToALeaseThatIsRenewed) {
  const auto lease = open("alps", holder("/var/lib/a", 17));
  ASSERT_TRUE(lease->wait(10.0).held);
  const auto renewed = [&] {
    put("alps", lease_text(holder("/var/lib/b", 18)));
    return !lease->state().held;
  };
  EXPECT_TRUE(comes(renewed));
  EXPECT_NE(lease->state().server_of("alps"), nullptr);
}

TEST_P(MissionLeasesOverNats, GoToAnotherServerWhenTheFirstIsOutOfReach) {
  test::TcpRelay relay(std::stoi(url_.substr(url_.rfind(':') + 1)), {});
  const auto first = MissionLease::open({.url = "nats://127.0.0.1:" + std::to_string(relay.port()), .mission = "alps"},
                                        holder("/var/lib/a", 17), kQuick)
                         .value();
  ASSERT_TRUE(first->wait(10.0).held);
  const auto second = open("alps", holder("/var/lib/b", 18));
  ASSERT_FALSE(second->wait(10.0).held);
  relay.refuse(true);
  const auto cut = std::chrono::steady_clock::now();
  EXPECT_TRUE(comes([&] { return second->state().held; }));
  EXPECT_GT(std::chrono::steady_clock::now() - cut, 2500ms);  // not at once: it may be a short cut
  relay.refuse(false);
  EXPECT_TRUE(comes([&] { return !first->state().held; }));
  ASSERT_NE(first->state().server_of("alps"), nullptr);
  EXPECT_EQ(first->state().server_of("alps")->state, "/var/lib/b");
}

TEST_P(MissionLeases, AreSeenByWhoReads) {
  EXPECT_EQ(served_mission({.url = url_, .mission = ""}, 0.3).value(), "tutti");  // nobody is there
  const auto alps = open("alps", holder("/var/lib/a", 17));
  ASSERT_TRUE(alps->wait(10.0).held);
  EXPECT_EQ(served_mission({.url = url_, .mission = ""}, 10.0).value(), "alps");
  const auto member = open("alps"), stranger = open("tutti");
  EXPECT_NE(member->wait(10.0).server_of("alps"), nullptr);
  EXPECT_EQ(member->why_alone(), "");
  EXPECT_TRUE(stranger->wait(10.0).has_looked);
  for (const char* word : {"'tutti'", "'alps'", "process 17", "/var/lib/a", "--mission"})
    EXPECT_NE(stranger->why_alone().find(word), std::string::npos) << stranger->why_alone();
  const auto jura = open("jura", holder("/var/lib/b", 18));
  ASSERT_TRUE(jura->wait(10.0).held);
  const auto several = served_mission({.url = url_, .mission = ""}, 10.0);
  ASSERT_FALSE(several.has_value());
  EXPECT_NE(several.error().message.find("alps, jura"), std::string::npos) << several.error().message;
  EXPECT_EQ(alps->why_alone(), "");
}

TEST(MissionNames, AreWordsOfASubject) {
  for (const char* name : {"tutti", "hku_two_sessions", "A-1"}) EXPECT_TRUE(check_mission_name(name)) << name;
  for (const char* name : {"", "two words", "a.b", "a*", ">", "0123456789012345678901234567890123"})
    EXPECT_FALSE(check_mission_name(name)) << name;
}

}  // namespace mission_lease_test
}  // namespace tutti::bus
