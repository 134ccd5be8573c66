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
#include "tutti/bus/nats_child.hpp"

namespace tutti::bus {
namespace mission_lease_test {

using namespace std::chrono_literals;

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
    return MissionLease::open({.url = bus_->url(), .mission = mission}, std::move(self)).value();
  }
  static LeaseHolder holder(const std::string& state, std::uint64_t process) {
    return {.host = "base", .process = process, .state = state, .since_ns = 1'700'000'000'000'000'000, .seat = state};
  }
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

TEST_F(MissionLeases, GoToTheSuccessorOnTheSameSeatAtOnce) {
  const auto killed = open("alps", holder("/var/lib/a", 17));  // as if: it is not told
  EXPECT_TRUE(killed->wait(10.0).held);
  EXPECT_TRUE(open("alps", holder("/var/lib/a", 99))->wait(10.0).held);
}

// Half a minute, the time that a lease lasts.
TEST_F(MissionLeases, GoToAnotherServerWhenTheFirstIsOutOfReach) {
  const std::string url = bus_->url();
  test::TcpRelay relay(std::stoi(url.substr(url.rfind(':') + 1)), {});
  const auto first = MissionLease::open({.url = "nats://127.0.0.1:" + std::to_string(relay.port()), .mission = "alps"},
                                        holder("/var/lib/a", 17))
                         .value();
  ASSERT_TRUE(first->wait(10.0).held);
  const auto second = open("alps", holder("/var/lib/b", 18));
  ASSERT_FALSE(second->wait(10.0).held);
  relay.refuse(true);
  const auto cut = std::chrono::steady_clock::now();
  while (!second->state().held && std::chrono::steady_clock::now() < cut + 60s) std::this_thread::sleep_for(100ms);
  EXPECT_TRUE(second->state().held);
  EXPECT_GT(std::chrono::steady_clock::now() - cut, 20s);  // not at once: it may be a short cut
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
