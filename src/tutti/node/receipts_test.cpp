// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/receipts.hpp"

#include <gtest/gtest.h>

namespace tutti::node {
namespace receipts_test {

constexpr Timestamp kStart{0};
constexpr RobotId kAlpha{0}, kStranger{7};

TEST(Receipts, AStrangerThatIsAdmittedKeepsItsReceipt) {
  Receipts receipts;
  Receipt* const receipt = receipts.of_anybody(kStranger, false, kStart);
  ASSERT_NE(receipt, nullptr);
  receipt->why_refused = "garbage";
  EXPECT_TRUE(receipts.members().empty());
  receipts.admit(kStranger);
  EXPECT_EQ(receipts.of_member(kStranger).why_refused, "garbage");
  receipts.dismiss(kStranger, kStart);
  EXPECT_TRUE(receipts.members().empty());
  ASSERT_NE(receipts.find(kStranger), nullptr);
  EXPECT_EQ(receipts.find(kStranger)->why_refused, "garbage");
  EXPECT_EQ(receipts.find(kAlpha), nullptr);
}

TEST(Receipts, StrangersAreBoundedUntilTheyAreGone) {
  Receipts receipts;
  std::uint32_t number = 100;
  while (receipts.of_anybody(RobotId{number}, false, kStart) != nullptr) ASSERT_LT(++number, 10'000U);
  EXPECT_NE(receipts.of_anybody(RobotId{100}, false, kStart), nullptr);  // who is known
  EXPECT_NE(receipts.of_anybody(kAlpha, true, kStart), nullptr);         // who is a member
  EXPECT_NE(receipts.of_anybody(RobotId{number}, false, kStart + Receipts::kStrangerIsGone_s), nullptr);
}

TEST(Receipts, AreSentAgainToARobotThatKeepsItsSubmaps) {
  Receipts receipts;
  NodeStatus status;
  status.backlog_submaps = 2;
  EXPECT_FALSE(receipts.waits_too_long(kAlpha, status, kStart));
  EXPECT_FALSE(receipts.waits_too_long(kAlpha, status, kStart + 59.0));
  EXPECT_TRUE(receipts.waits_too_long(kAlpha, status, kStart + 60.0));
  EXPECT_FALSE(receipts.waits_too_long(kAlpha, status, kStart + 61.0));
  status.backlog_submaps = 0;
  EXPECT_FALSE(receipts.waits_too_long(kAlpha, status, kStart + 130.0));
}

}  // namespace receipts_test
}  // namespace tutti::node
