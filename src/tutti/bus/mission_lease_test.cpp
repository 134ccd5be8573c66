// SPDX-License-Identifier: BSD-3-Clause
// One server of a mission on a bus, and how the next one gets its place.
#include "tutti/bus/mission_lease.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "support/bus/nats_server.hpp"
#include "support/bus/tcp_relay.hpp"
#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/bus/nats_child.hpp"

namespace tutti::bus {
namespace mission_lease_test {

using namespace std::chrono_literals;

constexpr std::uint64_t kNoProcess = 0x7fff'fff0;

class MissionLeases : public testing::Test {
 protected:
  void SetUp() override {
    TUTTI_SKIP_WITHOUT_NATS_SERVER();
    folder_ = std::filesystem::path(testing::TempDir()) / ("mission_lease_" + std::to_string(getpid()));
    auto started = NatsChild::start(folder_, {.max_store_bytes = 64U << 20U, .min_free_bytes = 0});
    ASSERT_TRUE(started.has_value()) << started.error().message;
    bus_ = std::move(*started);
  }
  void TearDown() override {
    bus_.reset();
    std::filesystem::remove_all(folder_);
  }
  [[nodiscard]] std::unique_ptr<MissionLease> open(const std::string& mission,
                                                   std::optional<LeaseHolder> self = {}) const {
    return MissionLease::open({.url = bus_->url(), .mission = mission}, std::move(self), kQuick).value();
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
  /// Somebody puts a value in the place of a lease, as anybody can.
  void put(const std::string& mission, const std::string& value) const {
    const auto connection = NatsConnection::open({.url = bus_->url()}, "somebody").value();
    ASSERT_TRUE(connection->publish("$KV.TUTTI_SERVERS." + mission, "", "", value).has_value());
    connection->flush();
  }
  [[nodiscard]] std::optional<LeaseHolder> written(const std::string& mission) const {
    const auto connection = NatsConnection::open({.url = bus_->url()}, "somebody").value();
    const auto value = connection->retained("TUTTI_SERVERS", "$KV.TUTTI_SERVERS." + mission).value();
    return value ? lease_of(*value) : std::nullopt;
  }
  static constexpr LeaseTimes kQuick{.lease_s = 4.0, .renew_s = 0.2, .unrenewed_s = 1.0, .look_s = 0.5, .rest_s = 60.0};

  /// Until it says so, or for half a minute.
  template <class Condition>
  static bool comes(Condition&& condition) {
    const auto end = std::chrono::steady_clock::now() + 30s;
    while (!condition() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(20ms);
    return condition();
  }

  std::filesystem::path folder_;
  std::unique_ptr<NatsChild> bus_;
};

TEST_F(MissionLeases, AreOfOneServerEach) {
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

TEST_F(MissionLeases, GoToTheSuccessorOnTheSameSeatAtOnceWhenTheFirstHasCertainlyEnded) {
  LeaseHolder self = holder("/var/lib/a", static_cast<std::uint64_t>(getpid())), first = self;
  self.mark = process_mark(1);
  first.mark = process_mark(2);
  first.process = kNoProcess;
  const auto made = open("jura", holder("/var/lib/b", 18));
  ASSERT_TRUE(made->wait(10.0).held);
  put("alps", lease_text(first));
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(open("alps", self)->wait(10.0).held);
  EXPECT_LT(std::chrono::steady_clock::now() - begin, 900ms);
}

TEST_F(MissionLeases, GoToTheSuccessorOnTheSameSeatWhenTheFirstRenewsNoMore) {
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
TEST_F(MissionLeases, AreOfOneOfTwoServersWithOneSeat) {
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

TEST_F(MissionLeases, AValueThatIsNoLeaseIsOverwritten) {
  const auto made = open("jura", holder("/var/lib/b", 18));
  ASSERT_TRUE(made->wait(10.0).held);
  put("alps", "x");
  EXPECT_EQ(served_mission({.url = bus_->url()}, 10.0).value(), "jura");  // it is no server
  const auto lease = open("alps", holder("/var/lib/a", 17));
  EXPECT_TRUE(lease->wait(10.0).held);  // of a server that starts,
  put("alps", "x");
  EXPECT_TRUE(comes([&] { return written("alps").has_value(); }));  // and of one that runs
  EXPECT_TRUE(lease->state().held);
}

TEST_F(MissionLeases, AHolderTakesBackALeaseThatNobodyRenews) {
  const auto lease = open("alps", holder("/var/lib/a", 17));
  ASSERT_TRUE(lease->wait(10.0).held);
  put("alps", lease_text(holder("/var/lib/b", 18)));
  EXPECT_TRUE(comes([&] { return !lease->state().waits.empty(); }));
  EXPECT_TRUE(lease->state().held);
  EXPECT_EQ(lease->state().server_of("alps"), nullptr);
  EXPECT_TRUE(comes([&] { return written("alps") == holder("/var/lib/a", 17); }));
  EXPECT_TRUE(lease->state().held);
}

TEST_F(MissionLeases, AHolderGivesWayToALeaseThatIsRenewed) {
  const auto lease = open("alps", holder("/var/lib/a", 17));
  ASSERT_TRUE(lease->wait(10.0).held);
  const auto renewed = [&] {
    put("alps", lease_text(holder("/var/lib/b", 18)));
    return !lease->state().held;
  };
  EXPECT_TRUE(comes(renewed));
  EXPECT_NE(lease->state().server_of("alps"), nullptr);
}

TEST_F(MissionLeases, GoToAnotherServerWhenTheFirstIsOutOfReach) {
  const std::string url = bus_->url();
  test::TcpRelay relay(std::stoi(url.substr(url.rfind(':') + 1)), {});
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

TEST_F(MissionLeases, AreSeenByWhoLooks) {
  EXPECT_EQ(served_mission({.url = bus_->url()}, 0.3).value(), "tutti");  // nobody is there
  const auto alps = open("alps", holder("/var/lib/a", 17));
  ASSERT_TRUE(alps->wait(10.0).held);
  EXPECT_EQ(served_mission({.url = bus_->url()}, 10.0).value(), "alps");
  const auto member = open("alps"), stranger = open("tutti");
  EXPECT_NE(member->wait(10.0).server_of("alps"), nullptr);
  EXPECT_EQ(member->why_alone(), "");
  EXPECT_TRUE(stranger->wait(10.0).has_looked);
  for (const char* word : {"'tutti'", "'alps'", "process 17", "/var/lib/a", "--mission"})
    EXPECT_NE(stranger->why_alone().find(word), std::string::npos) << stranger->why_alone();
  const auto jura = open("jura", holder("/var/lib/b", 18));
  ASSERT_TRUE(jura->wait(10.0).held);
  const auto several = served_mission({.url = bus_->url()}, 10.0);
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
