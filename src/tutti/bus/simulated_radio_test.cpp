// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/in_process_bus.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>

#include "tutti/base/config_io.hpp"

namespace tutti::bus {
namespace {

constexpr Timestamp kStart{1'000'000'000'000};
const Endpoint kServer = Endpoint::server();
const Endpoint kAlpha = Endpoint::of(RobotId{0});
const Endpoint kBravo = Endpoint::of(RobotId{1});

Timestamp at(double seconds) { return kStart + seconds; }

/// Pumps the bus as a mission does, from event to event, up to `until`.
std::vector<Delivery> pump(InProcessBus& bus, Timestamp until) {
  std::vector<Delivery> all;
  for (auto next = bus.next_delivery(); next && *next <= until; next = bus.next_delivery())
    for (Delivery& delivery : bus.deliver_until(*next)) all.push_back(std::move(delivery));
  return all;
}

/// All that is still under way, `now` being the time of the last message.
std::vector<Delivery> drain(InProcessBus& bus, Timestamp now) {
  std::vector<Delivery> all = bus.deliver_until(now);
  for (Delivery& delivery : pump(bus, at(1e6))) all.push_back(std::move(delivery));
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
std::vector<Delivery> send_submaps(InProcessBus& bus, bool pump_between) {
  std::vector<Delivery> all;
  for (int i = 0; i < 40; ++i) {
    if (pump_between)
      for (Delivery& delivery : pump(bus, at(i))) all.push_back(std::move(delivery));
    const Endpoint from = i % 2 == 0 ? kAlpha : kBravo;
    bus.publish(at(i), from, kServer, MessageKind::submap, std::to_string(i).append(10 * (i % 5), '.'));
  }
  for (Delivery& delivery : drain(bus, at(39))) all.push_back(std::move(delivery));
  return all;
}

RC_GTEST_PROP(InProcessBus, ReliableMessagesAllArriveOnceOrTwiceAndNeverEarly, ()) {
  const LinkConfig link = any_link();
  InProcessBus bus(kStart, link, *rc::gen::arbitrary<std::uint64_t>());
  std::map<int, int> copies;
  Timestamp previous = kStart;
  std::map<Endpoint, int> last_number;
  for (const Delivery& delivery : send_submaps(bus, *rc::gen::arbitrary<bool>())) {
    const int number = std::stoi(*delivery.bytes);
    const int count = ++copies[number];
    RC_ASSERT(delivery.sent == at(number));
    RC_ASSERT(delivery.arrived - delivery.sent >= link.latency_s - 1e-9);
    RC_ASSERT(delivery.arrived >= previous);
    RC_ASSERT(delivery.to == kServer);
    previous = delivery.arrived;
    if (link.in_order && count == 1) {
      RC_ASSERT(!last_number.contains(delivery.from) || last_number[delivery.from] < number);
      last_number[delivery.from] = number;
    }
    for (const Outage& outage : link.outages) {  // what was sent during an outage waits for its end
      if (number >= outage.from_s && number < outage.until_s)
        RC_ASSERT(delivery.arrived - kStart >= outage.until_s + link.latency_s - 1e-9);
    }
  }
  RC_ASSERT(copies.size() == 40U);
  for (const auto& [number, count] : copies) RC_ASSERT(count == 1 || (count == 2 && link.duplicate > 0.0));
}

RC_GTEST_PROP(InProcessBus, SameSeedSameDeliveriesHoweverOftenItIsPumped, ()) {
  const LinkConfig link = any_link();
  const auto seed = *rc::gen::arbitrary<std::uint64_t>();
  InProcessBus from_event_to_event(kStart, link, seed);
  const auto a = send_submaps(from_event_to_event, true);
  InProcessBus at_once(kStart, link, seed);
  const auto b = send_submaps(at_once, false);
  RC_ASSERT(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    RC_ASSERT(a[i].arrived == b[i].arrived);
    RC_ASSERT(*a[i].bytes == *b[i].bytes);
  }
  RC_ASSERT(from_event_to_event.statistics() == at_once.statistics());
}

TEST(InProcessBus, BroadcastsReachSubscribersOnly) {
  InProcessBus bus(kStart, {}, 1);
  bus.subscribe(kAlpha, MessageKind::proxy_graph);
  bus.publish(at(2), kServer, std::nullopt, MessageKind::proxy_graph, "2");
  bus.publish(at(2), kServer, std::nullopt, MessageKind::verdict, "nobody");
  const auto deliveries = bus.deliver_until(at(3));
  ASSERT_EQ(deliveries.size(), 1U);
  EXPECT_EQ(deliveries[0].to, kAlpha);
  EXPECT_EQ(*deliveries[0].bytes, "2");
  EXPECT_EQ(bus.next_delivery(), std::nullopt);
  bus.subscribe(kBravo, MessageKind::proxy_graph);
  bus.publish(at(4), kServer, std::nullopt, MessageKind::proxy_graph, "3");
  EXPECT_EQ(bus.deliver_until(at(5)).size(), 2U);
}

TEST(InProcessBus, OfWaitingProxyGraphsOnlyTheNewestIsSent) {
  LinkConfig link;
  link.outages = {{10.0, 60.0}};
  InProcessBus bus(kStart, link, 1);
  for (int i = 0; i < 6; ++i) bus.publish(at(10.0 * i), kServer, kAlpha, MessageKind::proxy_graph, std::to_string(i));
  const auto deliveries = drain(bus, at(50));
  ASSERT_EQ(deliveries.size(), 2U);
  EXPECT_EQ(*deliveries[0].bytes, "0");
  EXPECT_EQ(*deliveries[1].bytes, "5");
  EXPECT_EQ(deliveries[1].arrived, at(60.0) + link.latency_s);
  EXPECT_EQ(bus.statistics().at({kServer, kAlpha, MessageKind::proxy_graph}).superseded, 4U);
}

TEST(InProcessBus, LossCostsProxyGraphsForGoodAndOthersOnlyTime) {
  LinkConfig link;
  link.loss = 0.2;
  InProcessBus bus(kStart, link, 3);
  for (int i = 0; i < 2000; ++i) {
    bus.publish(at(i), kServer, kAlpha, MessageKind::proxy_graph, "graph");
    bus.publish(at(i), kAlpha, kServer, MessageKind::submap, "submap");
  }
  drain(bus, at(1999));
  const TopicStatistics down = bus.statistics().at({kServer, kAlpha, MessageKind::proxy_graph});
  const TopicStatistics up = bus.statistics().at({kAlpha, kServer, MessageKind::submap});
  EXPECT_NEAR(static_cast<double>(down.lost), 400.0, 60.0);
  EXPECT_EQ(down.delivered + down.lost, 2000U);
  EXPECT_EQ(up.delivered, 2000U);
  EXPECT_EQ(up.published_bytes, 12'000U);
  EXPECT_NEAR(static_cast<double>(up.transmitted_bytes), 12'000.0 / 0.8, 600.0);  // 1 / (1 - loss) attempts
}

TEST(InProcessBus, BandwidthMakesMessagesWaitForEachOtherInOneDirection) {
  LinkConfig link;
  link.latency_s = 0.5;
  link.bandwidth_bytes_per_s = 10.0;
  InProcessBus bus(kStart, link, 1);
  for (int i = 0; i < 3; ++i) bus.publish(at(0), kAlpha, kServer, MessageKind::submap, std::string(20, 'x'));
  bus.publish(at(0), kServer, kAlpha, MessageKind::verdict, std::string(10, 'x'));
  std::vector<double> up, down;
  for (const Delivery& delivery : drain(bus, at(0)))
    (delivery.to == kServer ? up : down).push_back(delivery.arrived - kStart);
  EXPECT_EQ(up, (std::vector<double>{2.5, 4.5, 6.5}));
  EXPECT_EQ(down, (std::vector<double>{1.5}));
}

TEST(InProcessBus, JitterReordersUnlessInOrder) {
  for (const bool in_order : {false, true}) {
    LinkConfig link;
    link.jitter_s = 5.0;
    link.in_order = in_order;
    InProcessBus bus(kStart, link, 2);
    for (int i = 0; i < 50; ++i) bus.publish(at(i), kAlpha, kServer, MessageKind::submap, std::to_string(100 + i));
    std::vector<std::string> order;
    for (const Delivery& delivery : drain(bus, at(49))) order.push_back(*delivery.bytes);
    EXPECT_EQ(order.size(), 50U);
    EXPECT_EQ(std::ranges::is_sorted(order), in_order);
  }
}

TEST(InProcessBus, FullQueueDropsTheOldest) {
  LinkConfig link;
  link.queue_messages = 3;
  link.outages = {{0.0, 100.0}};
  InProcessBus bus(kStart, link, 1);
  for (int i = 0; i < 5; ++i) bus.publish(at(i), kAlpha, kServer, MessageKind::submap, std::to_string(i));
  const auto deliveries = drain(bus, at(4));
  ASSERT_EQ(deliveries.size(), 3U);
  EXPECT_EQ(*deliveries[0].bytes, "2");
  EXPECT_EQ(bus.statistics().at({kAlpha, kServer, MessageKind::submap}).dropped, 2U);
}

TEST(InProcessBus, TenMinutesOutOfRangeCostNoSubmapAndAnotherRobotNothing) {
  InProcessBus bus(kStart, {}, 1);
  LinkConfig link;
  link.bandwidth_bytes_per_s = 20e3;
  link.outages = {{300.0, 900.0}};
  bus.set_link(RobotId{0}, link);
  for (int i = 0; i <= 100; ++i)  // a submap every 10 s from both, 30 kB each, and a proxy graph every 20 s
    for (const Endpoint robot : {kAlpha, kBravo}) {
      bus.publish(at(10.0 * i), robot, kServer, MessageKind::submap, std::to_string(i).append(30'000, '.'));
      if (i % 2 == 0) bus.publish(at(10.0 * i), kServer, robot, MessageKind::proxy_graph, std::to_string(i));
    }
  std::map<Endpoint, std::vector<int>> submaps;
  std::vector<int> graphs;
  for (const Delivery& delivery : drain(bus, at(1000))) {
    if (delivery.to == kAlpha) graphs.push_back(std::stoi(*delivery.bytes));
    if (delivery.to != kServer) continue;
    submaps[delivery.from].push_back(std::stoi(*delivery.bytes));
    const double age_s = delivery.arrived - delivery.sent;
    const bool away = delivery.from == kAlpha && delivery.sent >= at(300) && delivery.sent < at(900);
    EXPECT_EQ(delivery.arrived >= at(900), away || delivery.sent >= at(900));
    EXPECT_TRUE(delivery.from == kAlpha || age_s < 0.1);
  }
  for (const Endpoint robot : {kAlpha, kBravo}) {
    EXPECT_EQ(submaps[robot].size(), 101U);
    EXPECT_TRUE(std::ranges::is_sorted(submaps[robot]));
    const TopicStatistics up = bus.statistics().at({robot, kServer, MessageKind::submap});
    EXPECT_EQ(up.dropped + up.lost, 0U);
    EXPECT_EQ(up.largest_message, 30'003U);
  }
  // Of the proxy graphs of the ten minutes only the last is worth sending.
  EXPECT_EQ(graphs.size(), 51U - 29U);
  EXPECT_TRUE(std::ranges::find(graphs, 88) != graphs.end());
  EXPECT_EQ(bus.statistics().at({kServer, kAlpha, MessageKind::proxy_graph}).superseded, 29U);
}

TEST(InProcessBus, AirtimePausesOutOfRange) {
  LinkConfig link;
  link.latency_s = 0.5;
  link.bandwidth_bytes_per_s = 10.0;
  link.outages = {{5.0, 65.0}, {67.0, 70.0}, {69.0, 80.0}};
  InProcessBus bus(kStart, link, 1);
  bus.publish(at(0), kAlpha, kServer, MessageKind::submap, std::string(100, 'x'));  // 5 s before, 2 s between, 3 after
  bus.publish(at(1), kAlpha, kServer, MessageKind::submap, std::string(20, 'y'));
  bus.publish(at(1), kBravo, kServer, MessageKind::submap, std::string(40, 'z'));  // just in time
  std::vector<double> arrived;
  for (const Delivery& delivery : drain(bus, at(1))) arrived.push_back(delivery.arrived - kStart);
  EXPECT_EQ(arrived, (std::vector<double>{5.5, 83.5, 85.5}));
}

TEST(InProcessBus, RepetitionsWaitForContact) {
  LinkConfig link;
  link.latency_s = 0.0;
  link.loss = 0.7;
  link.retransmit_s = 3.0;
  link.outages = {{5.0, 25.0}, {31.0, 32.0}, {50.0, std::numeric_limits<double>::infinity()}};
  InProcessBus bus(kStart, link, 1);
  for (int i = 0; i < 50; ++i) bus.publish(at(i), kAlpha, kServer, MessageKind::submap, std::to_string(i));
  const auto deliveries = drain(bus, at(49));
  EXPECT_GT(deliveries.size(), 30U);
  for (const Delivery& delivery : deliveries)
    for (const Outage& outage : link.outages)
      EXPECT_FALSE(delivery.arrived >= at(outage.from_s) && delivery.arrived < at(outage.until_s))
          << *delivery.bytes << " at " << delivery.arrived - kStart;
  EXPECT_GT(bus.undelivered().at({kAlpha, kServer, MessageKind::submap}), 0U);
  EXPECT_EQ(bus.next_delivery(), std::nullopt);
}

TEST(InProcessBus, AnOutageForEverIsOne) {
  for (const double forever : {std::numeric_limits<double>::infinity(), 1e10}) {
    LinkConfig link;
    link.outages = {{10.0, forever}};
    InProcessBus bus(kStart, link, 1);
    bus.publish(at(0), kAlpha, kServer, MessageKind::submap, "heard");
    bus.publish(at(10), kAlpha, kServer, MessageKind::submap, "alone");
    bus.publish(at(11), kAlpha, kServer, MessageKind::submap, "and again");
    const auto deliveries = drain(bus, at(11));
    ASSERT_EQ(deliveries.size(), 1U);
    EXPECT_EQ(*deliveries[0].bytes, "heard");
    EXPECT_EQ(bus.next_delivery(), std::nullopt);
    EXPECT_EQ(bus.undelivered().at({kAlpha, kServer, MessageKind::submap}), 2U);
  }
}

TEST(InProcessBus, WhatArrivesAfterTheEndOfTimeNeverArrives) {
  InProcessBus bus(kStart, {.bandwidth_bytes_per_s = 1e-12}, 1);
  bus.publish(at(0), kAlpha, kServer, MessageKind::submap, "slow");
  bus.publish(at(1), kAlpha, kServer, MessageKind::submap, "slower");
  EXPECT_TRUE(drain(bus, at(1)).empty());
  EXPECT_EQ(bus.next_delivery(), std::nullopt);
  EXPECT_EQ(bus.undelivered().at({kAlpha, kServer, MessageKind::submap}), 2U);
}

TEST(InProcessBus, TimesThatNoRadioTakesAreRefused) {
  for (const std::string setting : {"latency_s", "jitter_s", "retransmit_s", "bandwidth_bytes_per_s"}) {
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

TEST(InProcessBus, EveryRobotMayHaveItsOwnLink) {
  InProcessBus bus(kStart, {}, 1);
  bus.set_link(RobotId{1}, {.latency_s = 3.0});
  bus.publish(at(0), kBravo, kServer, MessageKind::submap, "slow");
  bus.publish(at(0), kAlpha, kServer, MessageKind::submap, "fast");
  bus.publish(at(0), kServer, kServer, MessageKind::verdict, "own");
  const auto deliveries = drain(bus, at(0));
  ASSERT_EQ(deliveries.size(), 3U);
  EXPECT_EQ(*deliveries[0].bytes, "own");
  EXPECT_EQ(deliveries[0].arrived, at(0));
  EXPECT_EQ(*deliveries[1].bytes, "fast");
  EXPECT_EQ(*deliveries[2].bytes, "slow");
  EXPECT_THROW(bus.set_link(RobotId{1}, {}), std::logic_error);
  EXPECT_THROW(bus.publish(at(-1), kAlpha, kServer, MessageKind::submap, ""), std::logic_error);
  EXPECT_THROW(bus.publish(at(9), kAlpha, kBravo, MessageKind::submap, ""), std::logic_error);
}

}  // namespace
}  // namespace tutti::bus
