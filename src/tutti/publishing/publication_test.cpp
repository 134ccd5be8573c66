// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/publishing/publication.hpp"

#include <gtest/gtest.h>

#include <string>

#include "support/publishing/publications.hpp"
#include "tutti/pki/proof.hpp"

namespace tutti::publishing {
namespace publication_test {

using bus::BusRole;
using test::FakeBoard;

const std::string kHash(64, '0');
const Publication kMap{
    .map = "0a1b", .version = 7, .bytes = 300'000, .hash = kHash, .list_hash = kHash, .published_ns = 5};

using PublicationTest = test::Publications;

TEST_F(PublicationTest, WhatAnOperatorHasSignedIsBelieved) {
  const auto head = seal(kMap, anna_);
  ASSERT_TRUE(head.has_value()) << head.error().message;
  const auto read = unseal(*head, alpha_);
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_EQ(*read, kMap);
}

/// Certificates are text, in which some bits mean nothing.
TEST_F(PublicationTest, AFlippedBitNeverMakesAnotherPublication) {
  const std::string head = seal(kMap, anna_).value();
  std::size_t refused = 0;
  for (std::size_t i = 0; i < head.size(); ++i) {
    std::string flipped = head;
    flipped[i] = static_cast<char>(flipped[i] ^ (1 << (i % 8)));
    const auto read = unseal(flipped, alpha_);
    EXPECT_EQ(read.value_or(kMap), kMap) << "byte " << i;
    refused += read ? 0 : 1;
  }
  EXPECT_GT(refused, head.size() / 2);
}

TEST_F(PublicationTest, NobodyElseIsBelieved) {
  const std::string unsigned_head = seal(kMap, {}).value();
  const auto why = [&](const std::string& head) { return unseal(head, alpha_).error().message; };
  EXPECT_NE(why(unsigned_head).find("nobody has signed"), std::string::npos);
  EXPECT_EQ(unseal(unsigned_head, {}).value(), kMap);  // a bus without rights
  const std::string foreign = seal(kMap, add(other_, BusRole::operates, "anna")).value();
  EXPECT_NE(why(foreign).find("not of this mission's authority"), std::string::npos) << why(foreign);
  // Who is no operator does not sign here; another program may.
  EXPECT_NE(seal(kMap, alpha_).error().message.find("robot alpha"), std::string::npos);
  bus::BusCredentials disguised = alpha_;
  disguised.known->role = BusRole::operates;
  EXPECT_NE(why(seal(kMap, disguised).value()).find("robot alpha has signed it"), std::string::npos);
  // Anna's certificate, alpha's key.
  disguised = anna_;
  disguised.certificate.key = alpha_.certificate.key;
  EXPECT_NE(why(seal(kMap, disguised).value()).find("signature"), std::string::npos);
}

TEST_F(PublicationTest, WhatIsWrongInItIsRefused) {
  Publication large = kMap, elsewhere = kMap;
  large.bytes = kMostPublishedBytes + 1;
  elsewhere.hash = "../etc/passwd";
  for (const Publication& wrong : {large, elsewhere})
    EXPECT_FALSE(unseal(seal(wrong, anna_).value(), alpha_).has_value());
  FakeBoard board;
  EXPECT_FALSE(publish(board, "", {}, anna_, 1).has_value());
  EXPECT_FALSE(publish(board, std::string(kMostPublishedBytes + 1, 'x'), {}, anna_, 1).has_value());
  EXPECT_FALSE(publish(board, "map", {}, alpha_, 1).has_value());
  EXPECT_TRUE(board.values.empty());
}

std::string read_all(bus::MapBoard& board, const Offer::Entry& entry) {
  const std::string list = read_list(board, entry).value();
  std::string out;
  for (std::size_t i = 0; i < entry.publication.pieces(); ++i) out += read_piece(board, entry.slot, list, i).value();
  return out;
}

TEST_F(PublicationTest, TheLastTwoAreOnTheBusAndTheOlderCanBePublishedAgain) {
  FakeBoard board;
  EXPECT_FALSE(publish_older(board, anna_, 1).has_value());
  const std::string first = file_of(3, 'a'), second = file_of(5, 'b'), third = file_of(2, 'c');
  for (const std::string& file : {first, second, third})
    ASSERT_TRUE(publish(board, file, kMap, anna_, 100).has_value());  // by a clock that stands
  auto offer = read_offer(board, alpha_).value();
  EXPECT_EQ(read_all(board, *offer.newest), third);
  EXPECT_EQ(read_all(board, *offer.older), second);
  EXPECT_EQ(offer.newest->publication.published_ns, 102);
  ASSERT_TRUE(publish_older(board, anna_, 100).has_value());
  offer = read_offer(board, alpha_).value();
  EXPECT_EQ(read_all(board, *offer.newest), second);
  EXPECT_EQ(read_all(board, *offer.older), third);
  EXPECT_EQ(offer.newest->publication.published_ns, 103);
}

TEST_F(PublicationTest, OneThatIsCutAnywhereLeavesTheNewestWhole) {
  const std::string first = file_of(4, 'a'), second = file_of(4, 'b'), third = file_of(4, 'c');
  for (int cut = 0;; ++cut) {
    FakeBoard board;
    ASSERT_TRUE(publish(board, first, kMap, anna_, 1) && publish(board, second, kMap, anna_, 2));
    board.writes_left = cut;
    const bool is_whole = publish(board, third, kMap, anna_, 3).has_value();
    board.writes_left = -1;
    const auto offer = read_offer(board, alpha_).value();
    EXPECT_EQ(read_all(board, *offer.newest), is_whole ? third : second) << cut;
    const auto reverted = publish_older(board, anna_, 4);
    EXPECT_EQ(reverted.has_value(), is_whole || cut == 0) << cut;  // what is half written over is not published again
    if (is_whole) break;
    ASSERT_TRUE(publish(board, third, kMap, anna_, 5));
    EXPECT_EQ(read_all(board, *read_offer(board, alpha_)->newest), third) << cut;
  }
}

TEST_F(PublicationTest, AForgedHeadIsSaidAndDoesNotHideTheSignedOne) {
  FakeBoard board;
  ASSERT_TRUE(publish(board, file_of(2), kMap, anna_, 1));
  board.values["1.head"] = seal(kMap, {}).value();
  const auto offer = read_offer(board, alpha_).value();
  EXPECT_EQ(read_all(board, *offer.newest), file_of(2));
  EXPECT_NE(offer.refused.find("nobody has signed"), std::string::npos);
  board.values["0.1"] = "forged";
  EXPECT_FALSE(read_piece(board, 0, read_list(board, *offer.newest).value(), 1).has_value());
  board.values["0.list"] = "forged";
  EXPECT_FALSE(read_list(board, *offer.newest).has_value());
}

}  // namespace publication_test
}  // namespace tutti::publishing
