// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/internal/nats_outbox.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "tutti/base/content_hash.hpp"
#include "tutti/bus/internal/nats_names.hpp"

namespace tutti::bus {
namespace nats_outbox_test {

using namespace std::chrono_literals;

const Endpoint kRobot = Endpoint::of(RobotId{3});
constexpr Outbox::Time kStart{};

Envelope envelope(MessageKind kind, const std::string& id, std::size_t size, char content = 'x') {
  const bool from_server = delivery_of(kind) == Delivery::retained || kind == MessageKind::job;
  return {.from = from_server ? Endpoint::server() : kRobot,
          .to = from_server ? kRobot : Endpoint::server(),
          .kind = kind,
          .id = id,
          .bytes = std::make_shared<const std::string>(size, content)};
}

/// A part's id in envelope(MessageKind::submap, id, size).
std::string part_id(const std::string& id, std::size_t size, std::uint32_t index = 0, std::uint32_t count = 1) {
  return to_string(Part{MessageKind::submap, id, index, count, content_hash(std::string(size, 'x'))});
}

TEST(NatsOutbox, StatusGoesFirstThenRetainedThenTheRestInTheirOrder) {
  Outbox outbox("m", 1000);
  for (const char* id : {"a", "b"}) ASSERT_TRUE(outbox.add(envelope(MessageKind::submap, id, 10)));
  ASSERT_TRUE(outbox.add(envelope(MessageKind::proxy_graph, "", 10, '1')));
  ASSERT_TRUE(outbox.add(envelope(MessageKind::proxy_graph, "", 10, '2')));  // instead of the first
  ASSERT_TRUE(outbox.add(envelope(MessageKind::status, "", 10)));
  std::string order;
  while (const auto piece = outbox.next(kStart)) order += piece->subject + " " + piece->id + ";";
  EXPECT_EQ(order,
            "mission.m.robot.3.status ;$KV.GRAPH_m.robot.3.proxy_graph ;"
            "mission.m.robot.3.submap " +
                part_id("a", 10) + ";mission.m.robot.3.submap " + part_id("b", 10) + ";");
  EXPECT_EQ(outbox.messages(), 3U);
  EXPECT_EQ(outbox.bytes(), 30U);
}

TEST(NatsOutbox, ALargeMessageIsCutAndOnlySoMuchIsUnderWay) {
  Outbox outbox("m", 64U << 20U);
  ASSERT_TRUE(outbox.add(envelope(MessageKind::submap, "a", 1'000'000)));
  EXPECT_EQ(outbox.messages(), 8U);
  std::size_t under_way = 0;
  std::vector<std::uint64_t> numbers;
  while (const auto piece = outbox.next(kStart)) {
    under_way += piece->size;
    numbers.push_back(piece->number);
  }
  EXPECT_LE(under_way, 512U << 10U);
  outbox.confirm(numbers[0]);
  EXPECT_EQ(outbox.next(kStart)->id, part_id("a", 1'000'000, 4, 8));
  EXPECT_FALSE(outbox.next(kStart));
}

/// As after hours without a link.
TEST(NatsOutbox, OfSubmapsTheNewestGoesFirst) {
  Outbox outbox("m", 64U << 20U);
  for (const char* id : {"3/17/8", "3/17/9", "3/17/10", "3/18/0"})
    ASSERT_TRUE(outbox.add(envelope(MessageKind::submap, id, 200'000)));
  std::vector<std::string> order;
  while (const auto piece = outbox.next(kStart)) {
    order.push_back(piece->id.substr(7, piece->id.find('h') - 8) + piece->id.substr(piece->id.rfind('/')));
    outbox.confirm(piece->number);
  }
  EXPECT_EQ(order, (std::vector<std::string>{"3/18/0/0.2", "3/18/0/1.2", "3/17/10/0.2", "3/17/10/1.2", "3/17/9/0.2",
                                             "3/17/9/1.2", "3/17/8/0.2", "3/17/8/1.2"}));
}

TEST(NatsOutbox, WhatIsHereAlreadyDoesNotWaitTwice) {
  Outbox outbox("m", 64U << 20U);
  for (int i = 0; i < 3; ++i)
    for (const char* id : {"a", "a/1"}) ASSERT_TRUE(outbox.add(envelope(MessageKind::submap, id, 1'000'000)));
  EXPECT_EQ(outbox.messages(), 16U);
  while (const auto piece = outbox.next(kStart)) {
    ASSERT_TRUE(outbox.add(envelope(MessageKind::submap, "a/1", 1'000'000)));
    outbox.confirm(piece->number);
  }
  EXPECT_EQ(outbox.messages(), 0U);
  ASSERT_TRUE(outbox.add(envelope(MessageKind::submap, "a", 1'000'000)));
  EXPECT_EQ(outbox.messages(), 8U);
  ASSERT_TRUE(outbox.add(envelope(MessageKind::submap, "a", 1'000'000, 'y')));  // another content is another message
  EXPECT_EQ(outbox.messages(), 16U);
}

TEST(NatsOutbox, BoundsAreKept) {
  Outbox outbox("m", 1000);
  ASSERT_TRUE(outbox.add(envelope(MessageKind::submap, "a", 900)));
  const Status full = outbox.add(envelope(MessageKind::submap, "b", 101));
  ASSERT_FALSE(full.has_value());
  EXPECT_EQ(full.error().message, "submap b: 900 bytes wait to be sent already, 1000 may");
  EXPECT_TRUE(outbox.add(envelope(MessageKind::receipt, "", 500)));
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(outbox.add(envelope(MessageKind::status, "", 500)));
  EXPECT_EQ(outbox.messages(), 3U);  // of status the newest
  outbox.forget_best_effort();
  EXPECT_EQ(outbox.bytes(), 1400U);
  EXPECT_FALSE(Outbox("m", 1U << 30U).add(envelope(MessageKind::submap, "a", (16U << 20U) + 1)));
  EXPECT_FALSE(Outbox("m", 1U << 30U).add(envelope(MessageKind::job, "a", 8U << 20U)));
}

TEST(NatsOutbox, WhatIsRefusedOrNotConfirmedGoesAgain) {
  Outbox outbox("m", 1000);
  ASSERT_TRUE(outbox.add(envelope(MessageKind::submap, "a", 10)));
  auto piece = outbox.next(kStart);
  outbox.refuse(piece->number, kStart);
  EXPECT_FALSE(outbox.next(kStart + 400ms));
  piece = outbox.next(kStart + 600ms);
  ASSERT_TRUE(piece.has_value());
  outbox.expire(kStart + 10s);
  EXPECT_FALSE(outbox.next(kStart + 10s));
  outbox.expire(kStart + 21s);
  piece = outbox.next(kStart + 21s);
  ASSERT_TRUE(piece.has_value());
  outbox.resend_all();
  piece = outbox.next(kStart + 21s);
  ASSERT_TRUE(piece.has_value());
  outbox.refuse_all(kStart + 21s);
  EXPECT_FALSE(outbox.next(kStart + 21s));
  piece = outbox.next(kStart + 22s);
  ASSERT_TRUE(piece.has_value());
  EXPECT_EQ(piece->id, part_id("a", 10));
  outbox.confirm(piece->number);
  outbox.confirm(piece->number);  // heard twice
  EXPECT_EQ(outbox.messages(), 0U);
  EXPECT_EQ(outbox.bytes(), 0U);
}

TEST(NatsOutbox, TellsSinceWhenTheBusStoresNothing) {
  Outbox outbox("m", 1000);
  EXPECT_FALSE(outbox.unconfirmed_since());
  for (const char* id : {"a", "b", "c"}) ASSERT_TRUE(outbox.add(envelope(MessageKind::submap, id, 10)));
  auto piece = outbox.next(kStart + 1s);
  static_cast<void>(outbox.next(kStart + 2s));
  outbox.expire(kStart + 30s);
  static_cast<void>(outbox.next(kStart + 30s));
  EXPECT_EQ(outbox.unconfirmed_since(), kStart + 1s);
  outbox.confirm(piece->number);
  EXPECT_FALSE(outbox.unconfirmed_since());
  piece = outbox.next(kStart + 31s);
  EXPECT_EQ(outbox.unconfirmed_since(), kStart + 31s);
  outbox.refuse(piece->number, kStart + 32s);
  EXPECT_EQ(outbox.unconfirmed_since(), kStart + 31s);
  outbox.note_cut();
  EXPECT_FALSE(outbox.unconfirmed_since());
}

/// A bus that stores, refuses and forgets to confirm at random ends with everything, and with the newest retained
/// value.
RC_GTEST_PROP(NatsOutbox, EverythingArrivesAndTheNewestRetainedValueLast, ()) {
  Outbox outbox("m", 1U << 30U);
  std::set<std::string> sent;
  std::set<std::string> stored;
  char newest = 'a';
  char retained = ' ';
  Outbox::Time now = kStart;
  std::vector<Outbox::Piece> unconfirmed;
  const auto store = [&](const Outbox::Piece& piece) {
    if (piece.delivery == Delivery::retained) retained = (*piece.whole)[0];
    stored.insert(piece.id);
  };
  for (int step = 0; step < 200; ++step) {
    if (step < 60 && *rc::gen::inRange(0, 3) == 0) {
      const bool graph = *rc::gen::inRange(0, 2) == 0;
      const std::string id = std::to_string(step);
      if (graph) ++newest;
      RC_ASSERT(
          outbox.add(graph ? envelope(MessageKind::proxy_graph, "", 1, newest) : envelope(MessageKind::submap, id, 1))
              .has_value());
      if (!graph) sent.insert(part_id(id, 1));
    }
    now += 1s;
    outbox.expire(now);
    const int luck = step < 100 ? *rc::gen::inRange(0, 5) : 0;
    if (luck == 1) outbox.resend_all();
    const auto piece = outbox.next(now);
    if (!piece) continue;
    if (luck <= 1) store(*piece), outbox.confirm(piece->number);
    if (luck == 2) outbox.refuse(piece->number, now);
    if (luck == 3) store(*piece);  // and nobody hears of it
  }
  stored.erase("");
  RC_ASSERT(stored == sent);
  RC_ASSERT(newest == 'a' || retained == newest);
  RC_ASSERT(outbox.messages() == 0U);
  RC_ASSERT(outbox.bytes() == 0U);
}

}  // namespace nats_outbox_test
}  // namespace tutti::bus
