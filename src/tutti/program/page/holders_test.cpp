// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/holders.hpp"

#include <gtest/gtest.h>

namespace tutti::page {
namespace holders_test {

TEST(Holders, EverybodyHoldsOneThingUntilItEndsByItself) {
  Holders holders;
  EXPECT_EQ(holders.message(0.0, 5.0), (Message{"held", 5.0, "[]"}));
  ASSERT_TRUE(holders.hold("anna", "closure/alpha/1-bravo/2", 10.0));
  ASSERT_TRUE(holders.hold("boris", "closure/alpha/1-bravo/2", 20.0)) << "nobody is kept from anything";
  ASSERT_TRUE(holders.hold("anna", "robot/7", 25.0)) << "and looks at something else";
  EXPECT_EQ(holders.message(26.0, 0.0).value,
            R"([{"by":"anna","what":"robot/7"},{"by":"boris","what":"closure/alpha/1-bravo/2"}])");
  EXPECT_EQ(holders.message(50.0, 0.0).value, R"([{"by":"anna","what":"robot/7"}])");
  ASSERT_TRUE(holders.hold("anna", "robot/7", 51.0)) << "said again";
  EXPECT_NE(holders.message(80.0, 0.0).value, "[]");
  ASSERT_TRUE(holders.hold("anna", "", 80.0));
  EXPECT_EQ(holders.message(80.0, 0.0).value, "[]");
}

TEST(Holders, AreBounded) {
  Holders holders;
  EXPECT_FALSE(holders.hold("", "robot/7", 0.0));
  EXPECT_FALSE(holders.hold("anna", "the door", 0.0));
  EXPECT_FALSE(holders.hold("anna", "closure/" + std::string(1000, 'a'), 0.0));
  for (std::size_t i = 0; i < Holders::kMost; ++i) ASSERT_TRUE(holders.hold("p" + std::to_string(i), "robot/1", 0.0));
  EXPECT_FALSE(holders.hold("one more", "robot/1", 1.0));
  EXPECT_TRUE(holders.hold("p1", "robot/2", 1.0)) << "who is there goes on";
  EXPECT_TRUE(holders.hold("one more", "robot/1", 40.0)) << "when the others have gone";
}

}  // namespace holders_test
}  // namespace tutti::page
