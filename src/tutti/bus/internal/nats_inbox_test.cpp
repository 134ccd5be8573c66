// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/internal/nats_inbox.hpp"

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "tutti/base/content_hash.hpp"

namespace tutti::bus {
namespace nats_inbox_test {

using Replies = std::vector<std::string>;

const Endpoint kAlpha = Endpoint::of(RobotId{0});
const Endpoint kBravo = Endpoint::of(RobotId{1});

Part part(const std::string& id, std::uint32_t index = 0, std::uint32_t count = 1) {
  static const std::map<std::string, std::string> whole{
      {"a", "abcdef"}, {"half", "ABCdef"}, {"whole", "abc"}, {"real", "abc"}, {"slow", "xy"}};
  const auto found = whole.find(id);
  return {MessageKind::submap, id, index, count, found == whole.end() ? 0 : content_hash(found->second)};
}

TEST(NatsInbox, AMessageIsGivenOnceWhenItIsWholeAndAcknowledgedInAllItsParts) {
  Inbox inbox(Endpoint::server());
  EXPECT_TRUE(inbox.add_part(kAlpha, part("a", 1, 2), "def", "r1"));
  EXPECT_TRUE(inbox.take().empty());
  EXPECT_TRUE(inbox.add_part(kAlpha, part("a", 0, 2), "abc", "r0"));
  const auto taken = inbox.take();
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(*taken[0].envelope.bytes, "abcdef");
  EXPECT_EQ(taken[0].envelope.from, kAlpha);
  EXPECT_EQ(taken[0].envelope.to, Endpoint::server());
  EXPECT_EQ(inbox.held_bytes(), 6U);
  EXPECT_TRUE(inbox.add_part(kAlpha, part("a", 0, 2), "abc", "r0 again"));  // after the bus's 30 s
  EXPECT_TRUE(inbox.take().empty());
  EXPECT_EQ(inbox.unacknowledged(), (Replies{"r0 again", "r1"}));
  EXPECT_FALSE(inbox.next_acknowledgement());
  inbox.acknowledge(taken[0].ticket);
  inbox.acknowledge(taken[0].ticket);
  EXPECT_EQ(inbox.next_acknowledgement()->replies, (Replies{"r0 again", "r1"}));
  EXPECT_TRUE(inbox.unacknowledged().empty());
  inbox.forget(taken[0].ticket);
  EXPECT_FALSE(inbox.next_acknowledgement());
  EXPECT_EQ(inbox.held_bytes(), 0U);
  EXPECT_TRUE(inbox.add_part(kAlpha, part("a", 0, 2), "abc", "r0"));  // a bus that was killed has forgotten
  EXPECT_TRUE(inbox.add_part(kAlpha, part("a", 1, 2), "def", "r1"));
  EXPECT_TRUE(inbox.take().empty());
  EXPECT_EQ(inbox.take_strays(), (Replies{"r0", "r1"}));
  EXPECT_TRUE(inbox.take_strays().empty());
}

TEST(NatsInbox, OfAStreamThatTheBusHasLostNothingIsAcknowledgedAndHalvesAreForgotten) {
  Inbox inbox(Endpoint::server());
  EXPECT_TRUE(inbox.add_part(kAlpha, part("half", 0, 2), "abc", "1"));
  EXPECT_TRUE(inbox.add_part(kAlpha, part("whole", 0, 1), "abc", "2"));
  EXPECT_TRUE(inbox.add_part(kAlpha, {MessageKind::verdicts, "other", 0, 1, content_hash("abc")}, "abc", "3"));
  const auto taken = inbox.take();
  ASSERT_EQ(taken.size(), 2U);
  for (const Received& received : taken) inbox.acknowledge(received.ticket);
  inbox.forget_stream(MessageKind::submap);
  EXPECT_EQ(inbox.next_acknowledgement()->replies, Replies{});
  inbox.forget(taken[0].ticket);
  EXPECT_EQ(inbox.next_acknowledgement()->replies, Replies{"3"});
  EXPECT_TRUE(inbox.add_part(kAlpha, part("half", 1, 2), "def", "4"));
  EXPECT_TRUE(inbox.take().empty());
  EXPECT_TRUE(inbox.add_part(kAlpha, part("half", 0, 2), "ABC", "5"));
  EXPECT_EQ(*inbox.take().at(0).envelope.bytes, "ABCdef");
}

TEST(NatsInbox, MessagesOfOneIdButOtherSendersAreOthers) {
  Inbox inbox(Endpoint::server());
  EXPECT_TRUE(inbox.add_part(kAlpha, part("a", 0, 2), "ABC", "1"));
  EXPECT_TRUE(inbox.add_part(kBravo, part("a", 1, 2), "def", "2"));
  EXPECT_TRUE(inbox.take().empty());
  EXPECT_TRUE(inbox.add_part(kBravo, part("a", 0, 2), "abc", "3"));
  const auto taken = inbox.take();
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(*taken[0].envelope.bytes, "abcdef");
  EXPECT_FALSE(inbox.add_part(kAlpha, part("a", 1, 3), "of another", "4"));
}

TEST(NatsInbox, OfRetainedAndBestEffortOnlySoMuchWaits) {
  Inbox inbox(kAlpha);
  inbox.put_retained(Endpoint::server(), MessageKind::proxy_graph, "1");
  inbox.put_retained(Endpoint::server(), MessageKind::receipt, "receipt");
  inbox.put_retained(Endpoint::server(), MessageKind::proxy_graph, "2");
  auto taken = inbox.take();
  ASSERT_EQ(taken.size(), 2U);
  EXPECT_EQ(*taken[1].envelope.bytes, "2");
  inbox.acknowledge(taken[0].ticket);  // needless, and allowed
  EXPECT_FALSE(inbox.next_acknowledgement());
  inbox.put_best_effort(kAlpha, MessageKind::status, "alpha");
  for (int i = 0; i < 5000; ++i) {
    inbox.put_best_effort(kBravo, MessageKind::status, std::to_string(i));
    inbox.put_best_effort(kBravo, MessageKind::submap_request, std::to_string(i));
  }
  taken = inbox.take();
  EXPECT_EQ(taken.size(), 1U + 1U + 64U);
  EXPECT_EQ(*taken.front().envelope.bytes, "alpha");
  EXPECT_EQ(*taken.back().envelope.bytes, "4999");
  for (std::uint32_t i = 0; i < 10'000; ++i)
    inbox.put_best_effort(Endpoint::of(RobotId{i}), MessageKind::status, "of many");
  EXPECT_LE(inbox.take().size(), 5000U);
}

TEST(NatsInbox, HalvesOfASenderAreGivenUpBeforeTheyAreTooMany) {
  Inbox inbox(Endpoint::server());
  EXPECT_TRUE(inbox.add_part(kAlpha, part("real", 0, 3), "a", "real 0"));
  EXPECT_TRUE(inbox.add_part(kBravo, part("slow", 0, 2), "x", "slow 0"));
  for (int i = 0; i < 1100; ++i) {
    EXPECT_TRUE(inbox.add_part(kAlpha, part("orphan " + std::to_string(i), 1, 2), "o", std::to_string(i)));
    if (i == 10) {
      EXPECT_TRUE(inbox.add_part(kAlpha, part("real", 1, 3), "b", "real 1"));
    }
    if (i == 20) {
      EXPECT_TRUE(inbox.add_part(kAlpha, part("real", 2, 3), "c", "real 2"));
    }
  }
  EXPECT_EQ(inbox.given_up(), 1100U - Inbox::kMostHalves);
  EXPECT_EQ(inbox.take_strays().size(), inbox.given_up());  // the bus need not keep them
  EXPECT_TRUE(inbox.add_part(kBravo, part("slow", 1, 2), "y", "slow 1"));
  const auto taken = inbox.take();
  ASSERT_EQ(taken.size(), 2U);
  EXPECT_EQ(*taken[0].envelope.bytes, "abc");
  EXPECT_EQ(*taken[1].envelope.bytes, "xy");
}

TEST(NatsInbox, HalvesOfManySendersAreBoundedTooAndNoneWaitsForEver) {
  Inbox inbox(Endpoint::server());
  const auto later = Inbox::Time() + Inbox::kLongestHalf;
  const std::string bytes(kPartBytes, 'x');
  for (std::uint32_t i = 0; i < 1100; ++i)
    EXPECT_TRUE(inbox.add_part(Endpoint::of(RobotId{i}), part("a", 0, 2), bytes, "0", later));
  EXPECT_EQ(inbox.given_up(), 1100U - Inbox::kMostHalfBytesInAll / kPartBytes);
  EXPECT_FALSE(inbox.add_part(kAlpha, part("b", 0, 2), bytes + "x", "0", later));  // none of ours
  for (std::uint32_t i = 0; i < 10'000; ++i)
    EXPECT_TRUE(inbox.add_part(Endpoint::of(RobotId{i}), part("c", 0, 2), "x", "0", later));
  EXPECT_EQ(inbox.unacknowledged().size(), Inbox::kMostHalvesInAll);
  EXPECT_TRUE(inbox.add_part(kAlpha, part("d", 0, 2), "x", "0", later + Inbox::kLongestHalf));
  EXPECT_GT(inbox.unacknowledged().size(), 1U);
  EXPECT_TRUE(inbox.add_part(kAlpha, part("d", 0, 2), "x", "0", later + Inbox::kLongestHalf + std::chrono::seconds(1)));
  EXPECT_EQ(inbox.unacknowledged().size(), 1U);
}

TEST(NatsInbox, ContentsOfOneIdAreOtherMessagesAndOneThatIsNotWhatItSaysIsNone) {
  Inbox inbox(Endpoint::server());
  const std::uint64_t right = content_hash("abcdef");
  EXPECT_TRUE(inbox.add_part(kAlpha, {MessageKind::submap, "a", 0, 2, right + 1}, "abc", "wrong 0"));
  EXPECT_FALSE(inbox.add_part(kAlpha, {MessageKind::submap, "a", 1, 2, right + 1}, "def", "wrong 1"));
  EXPECT_EQ(inbox.take_strays(), Replies{"wrong 0"});
  EXPECT_TRUE(inbox.add_part(kAlpha, {MessageKind::submap, "a", 0, 1, content_hash("junk")}, "junk", "junk"));
  EXPECT_TRUE(inbox.add_part(kAlpha, {MessageKind::submap, "a", 0, 2, right}, "abc", "right 0"));
  inbox.acknowledge(inbox.take().at(0).ticket);
  inbox.forget(inbox.next_acknowledgement()->ticket);
  EXPECT_TRUE(inbox.add_part(kAlpha, {MessageKind::submap, "a", 1, 2, right}, "def", "right 1"));
  const auto taken = inbox.take();
  ASSERT_EQ(taken.size(), 1U);
  EXPECT_EQ(taken[0].envelope.id, "a");
  EXPECT_EQ(*taken[0].envelope.bytes, "abcdef");
}

}  // namespace nats_inbox_test
}  // namespace tutti::bus
