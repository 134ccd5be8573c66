// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/simulated_radio.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "tutti/base/config_io.hpp"

namespace tutti::bus {
namespace simulated_radio_test {

constexpr Timestamp kStart{1'000'000'000'000};
const Endpoint kServer = Endpoint::server();
const Endpoint kAlpha = Endpoint::of(RobotId{0});
const Endpoint kBravo = Endpoint::of(RobotId{1});

Timestamp at(double seconds) { return kStart + seconds; }

void send(SimulatedRadio& radio, Timestamp now, Endpoint from, Endpoint to, MessageKind kind, std::string bytes) {
  radio.send(now, {from, to, kind, {}, std::make_shared<const std::string>(std::move(bytes))});
}

/// Pumps the radio as a mission does, from event to event, up to `until`.
std::vector<Arrival> pump(SimulatedRadio& radio, Timestamp until) {
  std::vector<Arrival> all;
  for (auto next = radio.next_delivery(); next && *next <= until; next = radio.next_delivery())
    for (Arrival& arrival : radio.deliver_until(*next)) all.push_back(std::move(arrival));
  return all;
}

/// All that is still under way, `now` being the time of the last message.
std::vector<Arrival> drain(SimulatedRadio& radio, Timestamp now) {
  std::vector<Arrival> all = radio.deliver_until(now);
  for (Arrival& arrival : pump(radio, at(1e6))) all.push_back(std::move(arrival));
  return all;
}

LinkConfig any_link() {
  LinkConfig link;
  link.latency_s = *rc::gen::element(0.0, 0.02, 1.0);
  link.jitter_s = *rc::gen::element(0.0, 0.5, 10.0);
  link.loss = *rc::gen::element(0.0, 0.2, 0.7);
  link.duplicate = *rc::gen::element(0.0, 0.3, 1.0);
  link.in_order = *rc::gen::arbitrary<bool>();
  link.bandwidth_bytes_per_s = *rc::gen::element(0.0, 100.0, 1e5);
  if (*rc::gen::arbitrary<bool>()) link.outages = {{5.0, 25.0}, {20.0, 30.0}};
  return link;
}

/// 40 numbered messages of changing sizes, one per second, alternately from each robot; what arrives.
std::vector<Arrival> send_submaps(SimulatedRadio& radio, bool pump_between) {
  std::vector<Arrival> all;
  for (int i = 0; i < 40; ++i) {
    if (pump_between)
      for (Arrival& arrival : pump(radio, at(i))) all.push_back(std::move(arrival));
    const Endpoint from = i % 2 == 0 ? kAlpha : kBravo;
    send(radio, at(i), from, kServer, MessageKind::submap, std::to_string(i).append(10 * (i % 5), '.'));
  }
  for (Arrival& arrival : drain(radio, at(39))) all.push_back(std::move(arrival));
  return all;
}

RC_GTEST_PROP(SimulatedRadio, ReliableMessagesAllArriveOnceOrTwiceAndNeverEarly, ()) {
  const LinkConfig link = any_link();
  SimulatedRadio radio(kStart, link, *rc::gen::arbitrary<std::uint64_t>());
  std::map<int, int> copies;
  Timestamp previous = kStart;
  std::map<Endpoint, int> last_number;
  for (const Arrival& arrival : send_submaps(radio, *rc::gen::arbitrary<bool>())) {
    const int number = std::stoi(*arrival.bytes);
    const int count = ++copies[number];
    RC_ASSERT(arrival.sent == at(number));
    RC_ASSERT(arrival.arrived - arrival.sent >= link.latency_s - 1e-9);
    RC_ASSERT(arrival.arrived >= previous);
    RC_ASSERT(arrival.to == kServer);
    previous = arrival.arrived;
    if (link.in_order && count == 1) {
      RC_ASSERT(!last_number.contains(arrival.from) || last_number[arrival.from] < number);
      last_number[arrival.from] = number;
    }
    for (const Outage& outage : link.outages) {  // what was sent during an outage waits for its end
      if (number >= outage.from_s && number < outage.until_s)
        RC_ASSERT(arrival.arrived - kStart >= outage.until_s + link.latency_s - 1e-9);
    }
  }
  RC_ASSERT(copies.size() == 40U);
  for (const auto& [number, count] : copies) RC_ASSERT(count == 1 || (count == 2 && link.duplicate > 0.0));
}

RC_GTEST_PROP(SimulatedRadio, SameSeedSameDeliveriesHoweverOftenItIsPumped, ()) {
  const LinkConfig link = any_link();
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  SimulatedRadio from_event_to_event(kStart, link, seed);
  const auto a = send_submaps(from_event_to_event, true);
  SimulatedRadio at_once(kStart, link, seed);
  const auto b = send_submaps(at_once, false);
  RC_ASSERT(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    RC_ASSERT(a[i].arrived == b[i].arrived);
    RC_ASSERT(*a[i].bytes == *b[i].bytes);
  }
  RC_ASSERT(from_event_to_event.statistics() == at_once.statistics());
}

TEST(SimulatedRadio, OfWaitingProxyGraphsOnlyTheNewestIsSent) {
  LinkConfig link;
  link.outages = {{10.0, 60.0}};
  SimulatedRadio radio(kStart, link, 1);
  for (int i = 0; i < 6; ++i) send(radio, at(10.0 * i), kServer, kAlpha, MessageKind::proxy_graph, std::to_string(i));
  const auto arrivals = drain(radio, at(50));
  ASSERT_EQ(arrivals.size(), 2U);
  EXPECT_EQ(*arrivals[0].bytes, "0");
  EXPECT_EQ(*arrivals[1].bytes, "5");
  EXPECT_EQ(arrivals[1].arrived, at(60.0) + link.latency_s);
  EXPECT_EQ(radio.statistics().at({kServer, kAlpha, MessageKind::proxy_graph}).superseded, 4U);
}

TEST(SimulatedRadio, LossCostsDeltasForGoodAndOthersOnlyTime) {
  LinkConfig link;
  link.loss = 0.2;
  SimulatedRadio radio(kStart, link, 3);
  for (int i = 0; i < 2000; ++i) {
    send(radio, at(i), kServer, kAlpha, MessageKind::proxy_graph_delta, "delta");
    send(radio, at(i), kAlpha, kServer, MessageKind::submap, "submap");
  }
  drain(radio, at(1999));
  const TopicStatistics down = radio.statistics().at({kServer, kAlpha, MessageKind::proxy_graph_delta});
  const TopicStatistics up = radio.statistics().at({kAlpha, kServer, MessageKind::submap});
  EXPECT_NEAR(static_cast<double>(down.lost), 400.0, 60.0);
  EXPECT_EQ(down.delivered + down.lost, 2000U);
  EXPECT_EQ(up.delivered, 2000U);
  EXPECT_EQ(up.published_bytes, 12'000U);
  EXPECT_NEAR(static_cast<double>(up.transmitted_bytes), 12'000.0 / 0.8, 600.0);  // 1 / (1 - loss) attempts
}

TEST(SimulatedRadio, BandwidthMakesMessagesWaitForEachOtherInOneDirection) {
  LinkConfig link;
  link.latency_s = 0.5;
  link.bandwidth_bytes_per_s = 10.0;
  SimulatedRadio radio(kStart, link, 1);
  for (int i = 0; i < 3; ++i) send(radio, at(0), kAlpha, kServer, MessageKind::submap, std::string(20, 'x'));
  send(radio, at(0), kServer, kAlpha, MessageKind::receipt, std::string(10, 'x'));
  std::vector<double> up, down;
  for (const Arrival& arrival : drain(radio, at(0)))
    (arrival.to == kServer ? up : down).push_back(arrival.arrived - kStart);
  EXPECT_EQ(up, (std::vector<double>{2.5, 4.5, 6.5}));
  EXPECT_EQ(down, (std::vector<double>{1.5}));
}

TEST(SimulatedRadio, JitterReordersUnlessInOrder) {
  for (const bool in_order : {false, true}) {
    LinkConfig link;
    link.jitter_s = 5.0;
    link.in_order = in_order;
    SimulatedRadio radio(kStart, link, 2);
    for (int i = 0; i < 50; ++i) send(radio, at(i), kAlpha, kServer, MessageKind::submap, std::to_string(100 + i));
    std::vector<std::string> order;
    for (const Arrival& arrival : drain(radio, at(49))) order.push_back(*arrival.bytes);
    EXPECT_EQ(order.size(), 50U);
    EXPECT_EQ(std::ranges::is_sorted(order), in_order);
  }
}

TEST(SimulatedRadio, FullQueueDropsTheOldest) {
  LinkConfig link;
  link.queue_messages = 3;
  link.outages = {{0.0, 100.0}};
  SimulatedRadio radio(kStart, link, 1);
  for (int i = 0; i < 5; ++i) send(radio, at(i), kAlpha, kServer, MessageKind::submap, std::to_string(i));
  const auto arrivals = drain(radio, at(4));
  ASSERT_EQ(arrivals.size(), 3U);
  EXPECT_EQ(*arrivals[0].bytes, "2");
  EXPECT_EQ(radio.statistics().at({kAlpha, kServer, MessageKind::submap}).dropped, 2U);
}

TEST(SimulatedRadio, TenMinutesOutOfRangeCostNoSubmapAndAnotherRobotNothing) {
  SimulatedRadio radio(kStart, {}, 1);
  LinkConfig link;
  link.bandwidth_bytes_per_s = 20e3;
  link.outages = {{300.0, 900.0}};
  radio.set_link(RobotId{0}, link);
  for (int i = 0; i <= 100; ++i)  // a submap every 10 s from both, 30 kB each, and a proxy graph every 20 s
    for (const Endpoint robot : {kAlpha, kBravo}) {
      send(radio, at(10.0 * i), robot, kServer, MessageKind::submap, std::to_string(i).append(30'000, '.'));
      if (i % 2 == 0) send(radio, at(10.0 * i), kServer, robot, MessageKind::proxy_graph, std::to_string(i));
    }
  std::map<Endpoint, std::vector<int>> submaps;
  std::vector<int> graphs;
  for (const Arrival& arrival : drain(radio, at(1000))) {
    if (arrival.to == kAlpha) graphs.push_back(std::stoi(*arrival.bytes));
    if (arrival.to != kServer) continue;
    submaps[arrival.from].push_back(std::stoi(*arrival.bytes));
    const double age_s = arrival.arrived - arrival.sent;
    const bool away = arrival.from == kAlpha && arrival.sent >= at(300) && arrival.sent < at(900);
    EXPECT_EQ(arrival.arrived >= at(900), away || arrival.sent >= at(900));
    EXPECT_TRUE(arrival.from == kAlpha || age_s < 0.1);
  }
  for (const Endpoint robot : {kAlpha, kBravo}) {
    EXPECT_EQ(submaps[robot].size(), 101U);
    EXPECT_TRUE(std::ranges::is_sorted(submaps[robot]));
    const TopicStatistics up = radio.statistics().at({robot, kServer, MessageKind::submap});
    EXPECT_EQ(up.dropped + up.lost, 0U);
    EXPECT_EQ(up.largest_message, 30'003U);
  }
  // Only the last proxy graph of the ten minutes is worth sending.
  EXPECT_EQ(graphs.size(), 51U - 29U);
  EXPECT_TRUE(std::ranges::find(graphs, 88) != graphs.end());
  EXPECT_EQ(radio.statistics().at({kServer, kAlpha, MessageKind::proxy_graph}).superseded, 29U);
}

TEST(SimulatedRadio, AirtimePausesOutOfRange) {
  LinkConfig link;
  link.latency_s = 0.5;
  link.bandwidth_bytes_per_s = 10.0;
  link.outages = {{5.0, 65.0}, {67.0, 70.0}, {69.0, 80.0}};
  SimulatedRadio radio(kStart, link, 1);
  send(radio, at(0), kAlpha, kServer, MessageKind::submap, std::string(100, 'x'));  // 5 s before, 2 s between, 3 after
  send(radio, at(1), kAlpha, kServer, MessageKind::submap, std::string(20, 'y'));
  send(radio, at(1), kBravo, kServer, MessageKind::submap, std::string(40, 'z'));  // just in time
  std::vector<double> arrived;
  for (const Arrival& arrival : drain(radio, at(1))) arrived.push_back(arrival.arrived - kStart);
  EXPECT_EQ(arrived, (std::vector<double>{5.5, 83.5, 85.5}));
}

TEST(SimulatedRadio, RepetitionsWaitForContact) {
  LinkConfig link;
  link.latency_s = 0.0;
  link.loss = 0.7;
  link.retransmit_s = 3.0;
  link.outages = {{5.0, 25.0}, {31.0, 32.0}, {50.0, std::numeric_limits<double>::infinity()}};
  SimulatedRadio radio(kStart, link, 1);
  for (int i = 0; i < 50; ++i) send(radio, at(i), kAlpha, kServer, MessageKind::submap, std::to_string(i));
  const auto arrivals = drain(radio, at(49));
  EXPECT_GT(arrivals.size(), 30U);
  for (const Arrival& arrival : arrivals)
    for (const Outage& outage : link.outages)
      EXPECT_FALSE(arrival.arrived >= at(outage.from_s) && arrival.arrived < at(outage.until_s))
          << *arrival.bytes << " at " << arrival.arrived - kStart;
  EXPECT_GT(radio.undelivered().at({kAlpha, kServer, MessageKind::submap}), 0U);
  EXPECT_EQ(radio.next_delivery(), std::nullopt);
}

TEST(SimulatedRadio, AnOutageForEverIsOne) {
  for (const double forever : {std::numeric_limits<double>::infinity(), 1e10}) {
    LinkConfig link;
    link.outages = {{10.0, forever}};
    SimulatedRadio radio(kStart, link, 1);
    send(radio, at(0), kAlpha, kServer, MessageKind::submap, "heard");
    send(radio, at(10), kAlpha, kServer, MessageKind::submap, "alone");
    send(radio, at(11), kAlpha, kServer, MessageKind::submap, "and again");
    const auto arrivals = drain(radio, at(11));
    ASSERT_EQ(arrivals.size(), 1U);
    EXPECT_EQ(*arrivals[0].bytes, "heard");
    EXPECT_EQ(radio.next_delivery(), std::nullopt);
    EXPECT_EQ(radio.undelivered().at({kAlpha, kServer, MessageKind::submap}), 2U);
  }
}

TEST(SimulatedRadio, KnowsWhenARobotWasInRangeLast) {
  LinkConfig link;
  link.outages = {{10.0, 20.0}, {20.0, 25.0}, {18.0, 22.0}, {40.0, std::numeric_limits<double>::infinity()}};
  SimulatedRadio radio(kStart, {}, 1);
  radio.set_link(*kAlpha.robot(), link);
  for (const auto& [now_s, last_s] : {std::pair(0.0, 0.0),
                                      {9.0, 9.0},
                                      {10.0, 10.0},
                                      {15.0, 10.0},
                                      {24.9, 10.0},
                                      {25.0, 25.0},
                                      {39.0, 39.0},
                                      {90.0, 40.0}})
    EXPECT_EQ(radio.last_contact(*kAlpha.robot(), at(now_s)), at(last_s)) << now_s;
  EXPECT_EQ(radio.last_contact(RobotId{99}, at(15.0)), at(15.0)) << "whose link has no outage";
}

TEST(SimulatedRadio, WhatArrivesAfterTheEndOfTimeNeverArrives) {
  SimulatedRadio radio(kStart, {.bandwidth_bytes_per_s = 1e-12}, 1);
  send(radio, at(0), kAlpha, kServer, MessageKind::submap, "slow");
  send(radio, at(1), kAlpha, kServer, MessageKind::submap, "slower");
  EXPECT_TRUE(drain(radio, at(1)).empty());
  EXPECT_EQ(radio.next_delivery(), std::nullopt);
  EXPECT_EQ(radio.undelivered().at({kAlpha, kServer, MessageKind::submap}), 2U);
}

TEST(SimulatedRadio, TimesThatNoRadioTakesAreRefused) {
  for (const std::string setting : {"latency_s", "jitter_s", "bandwidth_bytes_per_s"}) {
    const auto node = parse_yaml(setting + ": .inf", "link");
    ASSERT_TRUE(node.has_value());
    LinkConfig link;
    const Status ok = load_config(*node, link, "link");
    ASSERT_FALSE(ok.has_value()) << setting;
    EXPECT_NE(ok.error().message.find(setting + ": is .inf, must be in [0, "), std::string::npos) << ok.error().message;
  }
  const auto away = parse_yaml("outages: [{from_s: 5, until_s: .inf}]", "link");
  LinkConfig link;
  EXPECT_TRUE(load_config(*away, link, "link").has_value());
}

TEST(SimulatedRadio, EveryRobotMayHaveItsOwnLink) {
  SimulatedRadio radio(kStart, {}, 1);
  radio.set_link(RobotId{1}, {.latency_s = 3.0});
  send(radio, at(0), kBravo, kServer, MessageKind::submap, "slow");
  send(radio, at(0), kAlpha, kServer, MessageKind::submap, "fast");
  const auto arrivals = drain(radio, at(0));
  ASSERT_EQ(arrivals.size(), 2U);
  EXPECT_EQ(*arrivals[0].bytes, "fast");
  EXPECT_EQ(*arrivals[1].bytes, "slow");
  EXPECT_THROW(radio.set_link(RobotId{1}, {}), std::logic_error);
  EXPECT_THROW(send(radio, at(-1), kAlpha, kServer, MessageKind::submap, ""), std::logic_error);
  EXPECT_THROW(send(radio, at(9), kAlpha, kBravo, MessageKind::submap, ""), std::logic_error);
  EXPECT_THROW(send(radio, at(9), kServer, kServer, MessageKind::submap, ""), std::logic_error);
  EXPECT_THROW(send(radio, at(9), Endpoint::worker(1), kServer, MessageKind::verdicts, ""), std::logic_error);
}

TEST(SimulatedRadio, WhatHasNotLeftGoesWithTheProgram) {
  SimulatedRadio radio(kStart, {.latency_s = 5.0, .outages = {{1.0, 60.0}}}, 1);
  send(radio, at(0), kAlpha, kServer, MessageKind::submap, "left");
  for (const Endpoint robot : {kAlpha, kBravo}) send(radio, at(2), robot, kServer, MessageKind::submap, "waits");
  send(radio, at(2), kServer, kAlpha, MessageKind::proxy_graph, "waits on land");
  radio.forget_waiting(kAlpha);
  std::multiset<std::string> heard;
  for (const Arrival& arrival : drain(radio, at(2))) heard.insert(*arrival.bytes);
  EXPECT_EQ(heard, (std::multiset<std::string>{"left", "waits", "waits on land"}));
}

TEST(SimulatedRadio, WhatBefallsAKindDoesNotDependOnOthers) {
  const auto submaps_heard = [](bool with_receipts) {
    SimulatedRadio radio(kStart, {.jitter_s = 3.0, .loss = 0.3}, 1);
    std::vector<Timestamp> heard;
    for (int i = 0; i < 50; ++i) {
      if (with_receipts) send(radio, at(i), kServer, kAlpha, MessageKind::receipt, "receipt");
      send(radio, at(i), kAlpha, kServer, MessageKind::submap, "submap");
    }
    for (const Arrival& arrival : drain(radio, at(49)))
      if (arrival.kind == MessageKind::submap) heard.push_back(arrival.arrived);
    return heard;
  };
  EXPECT_EQ(submaps_heard(true), submaps_heard(false));
}

}  // namespace simulated_radio_test
}  // namespace tutti::bus
