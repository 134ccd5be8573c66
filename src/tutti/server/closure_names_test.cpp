// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/closure_names.hpp"

#include <gtest/gtest.h>

namespace tutti::server {
namespace closure_names_test {

const RobotId kAlpha{0}, kRover{1}, kNameless{2}, kTwin{3}, kOther{4}, kOdd{5};
const std::set<ChainId> kChains{
    {kAlpha, 0}, {kAlpha, 1'700'000'000'000}, {kRover, 5}, {kNameless, 1}, {kNameless, 2}, {kTwin, 0}, {kOther, 0},
    {kOdd, 7}};
const ClosureNames kNames({{kAlpha, "alpha"}, {kRover, "rover-2"}, {kTwin, "twin"}, {kOther, "twin"}, {kOdd, "a b/1"}},
                          kChains);

TEST(ClosureNames, AreReadable) {
  EXPECT_EQ(kNames.of(SubmapPair{{kAlpha, 12}, {{kRover, 5}, 7}}), "alpha/12-rover-2/7");
  EXPECT_EQ(kNames.of(ChainId(kAlpha, 1'700'000'000'000)), "alpha.2");
  EXPECT_EQ(kNames.of(ChainId(kNameless, 2)), "2.2");
  EXPECT_EQ(kNames.of(ChainId(kTwin)), "3");
  EXPECT_EQ(kNames.of(ChainId(kOdd, 7)), "5");
}

TEST(ClosureNames, AreFoundAgain) {
  for (const ChainId& a : kChains)
    for (const ChainId& b : kChains)
      for (const std::uint32_t index : {0U, 3U, 4'000'000'000U}) {
        const SubmapId one{a, index}, other{b, 2};
        const SubmapPair pair{std::min(one, other), std::max(one, other)};
        const auto found = kNames.find(kNames.of(pair));
        ASSERT_TRUE(found.has_value()) << kNames.of(pair);
        EXPECT_EQ(*found, pair);
      }
}

TEST(ClosureNames, NumbersAndEitherOrderWillDo) {
  const SubmapPair pair{{{kAlpha, 1'700'000'000'000}, 12}, {{kRover, 5}, 7}};
  for (const char* name : {"alpha.2/12-rover-2/7", "rover-2/7-alpha.2/12", "0:1700000000000/12-1:5/7"}) {
    const auto found = kNames.find(name);
    ASSERT_TRUE(found.has_value()) << name;
    EXPECT_EQ(*found, pair);
  }
}

TEST(ClosureNames, WhatNamesNoPairIsRefusedAndTheRobotsAreNamed) {
  for (const char* name : {"", "-", "alpha/1", "alpha/1-", "alpha/1-beta/2", "alpha/x-rover-2/1", "alpha/1-rover-2/1 ",
                           "alpha/1-alpha/1", "alpha/99999999999-rover-2/1", "alpha.3/1-rover-2/1"}) {
    const auto found = kNames.find(name);
    ASSERT_FALSE(found.has_value()) << name;
    EXPECT_TRUE(found.error().message.find("rover-2") != std::string::npos ||
                found.error().message.find("itself") != std::string::npos);
  }
}

TEST(ClosureNames, ANameThatLooksLikeASessionIsNotTakenForOne) {
  const ClosureNames names({{RobotId{0}, "a"}, {RobotId{1}, "a.2"}},
                           {{RobotId{0}, 1}, {RobotId{0}, 2}, {RobotId{1}, 1}});
  std::set<std::string> all;
  for (const ChainId& chain : {ChainId(RobotId{0}, 1), ChainId(RobotId{0}, 2), ChainId(RobotId{1}, 1)}) {
    all.insert(names.of(chain));
    const SubmapPair pair{{chain, 1}, {chain, 2}};
    EXPECT_EQ(names.find(names.of(pair)).value(), pair);
  }
  EXPECT_EQ(all.size(), 3U);
}

}  // namespace closure_names_test
}  // namespace tutti::server
