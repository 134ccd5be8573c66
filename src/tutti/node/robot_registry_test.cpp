// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/robot_registry.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <vector>

namespace tutti::node {
namespace robot_registry_test {

constexpr RobotId kOne{1}, kTwo{2};

NodeStatus status(const std::string& name, std::uint64_t session) { return {.name = name, .session = session}; }
Timestamp at(double s) { return Timestamp{} + s; }

class Registry : public testing::Test {
 protected:
  Registry() { registry_.start(at(0)); }
  /// Whether it is accepted.
  bool hear(RobotId robot, const std::string& name, std::uint64_t session, double s) {
    const auto heard = registry_.hear(robot, status(name, session), at(s));
    EXPECT_EQ(heard.accepted, heard.why.empty());
    why_ = heard.why;
    return heard.accepted;
  }
  void restart(double s) {
    RobotRegistry fresh;
    fresh.start(at(s));
    for (const auto& [robot, entry] : registry_.robots())
      if (entry.is_claimed) {
        EXPECT_TRUE(fresh.restore(robot, registry_.row(robot)));
      }
    registry_ = fresh;
  }
  [[nodiscard]] std::uint64_t owner(RobotId robot) const { return registry_.owner(robot).value().session; }
  RobotRegistry registry_;
  std::string why_;
};

TEST_F(Registry, ANameAndANumberBelongToOneSessionWhileItIsThere) {
  EXPECT_EQ(registry_.owner(kOne), std::nullopt);
  EXPECT_TRUE(hear(kOne, "alpha", 10, 0));
  EXPECT_TRUE(hear(kOne, "alpha", 10, 2));
  EXPECT_FALSE(hear(kOne, "alpha", 11, 3));
  EXPECT_NE(why_.find("another robot 'alpha' is there, session 10"), std::string::npos) << why_;
  EXPECT_FALSE(hear(kTwo, "alpha", 11, 3));
  EXPECT_NE(why_.find("the name 'alpha' is in use by robot number 1"), std::string::npos) << why_;
  EXPECT_FALSE(hear(kOne, "bravo", 10, 3));
  EXPECT_NE(why_.find("number 1 belongs to robot 'alpha'"), std::string::npos) << why_;
  EXPECT_TRUE(hear(kTwo, "bravo", 5, 3));
  EXPECT_EQ(owner(kOne), 10U);
  EXPECT_EQ(registry_.robots().at(kOne).last_seen, at(2));
}

/// A status of the session and start, and whether it is accepted.
bool hears(RobotRegistry& registry, std::uint64_t session, std::uint64_t start, double s) {
  NodeStatus sent = status("alpha", session);
  sent.start = start;
  return registry.hear(kOne, sent, at(s)).accepted;
}

TEST_F(Registry, OfTwoLivingProgramsOfASessionTheSecondIsRefusedUntilTheFirstIsGone) {
  constexpr std::uint64_t kFirst = (5ULL << 32U) + 4, kSecond = (9ULL << 32U) + 4;
  for (int i = 0; i < 5; ++i) EXPECT_TRUE(hears(registry_, 10, kFirst, 2.0 * i));
  int refused = 0;
  for (int i = 5; i < 20; ++i) {
    const bool is_refused = !hears(registry_, 10, kSecond, 2.0 * i);
    EXPECT_TRUE(hears(registry_, 10, kFirst, 2.0 * i + 1.0));
    EXPECT_TRUE(is_refused || i < 10) << i;
    refused += is_refused ? 1 : 0;
  }
  EXPECT_GE(refused, 10);
  EXPECT_EQ(registry_.robots().at(kOne).status.start, kFirst);
  EXPECT_NE(registry_.robots().at(kOne).conflict.find("was copied"), std::string::npos);
  EXPECT_TRUE(hears(registry_, 10, kSecond, 2.0 * 20 + 31.0));
}

TEST_F(Registry, AProgramThatStartsAgainAndAgainIsNoSecondOne) {
  for (std::uint64_t start = 1; start < 50; ++start) {
    const double s = 3.0 * static_cast<double>(start);
    EXPECT_TRUE(hears(registry_, 10, (start * 77 << 32U) + start, s));
    if (start > 1) {
      EXPECT_TRUE(hears(registry_, 10, ((start - 1) * 77 << 32U) + start - 1, s + 1.0));  // it was late
    }
    EXPECT_TRUE(hears(registry_, 10, (start * 77 << 32U) + start, s + 2.0));
  }
}

TEST_F(Registry, AProgramMayBeginAnotherSession) {
  constexpr std::uint64_t kStart = (5ULL << 32U) + 1;
  EXPECT_TRUE(hears(registry_, 10, kStart, 0.0));
  EXPECT_TRUE(hears(registry_, 11, kStart, 2.0));
  EXPECT_EQ(owner(kOne), 11U);
  EXPECT_FALSE(hears(registry_, 12, (6ULL << 32U) + 1, 4.0));  // another program
}

// The map has a submap of the second one under an id that the first one used next, so that it had to begin another
// session.
TEST_F(Registry, OfTwoProgramsOfASessionTheFirstMayBeginAnotherAndTheSecondMayNot) {
  constexpr std::uint64_t kFirst = (5ULL << 32U) + 4, kSecond = (9ULL << 32U) + 4;
  for (const std::uint64_t leaves : {kFirst, kSecond}) {
    registry_ = {};
    EXPECT_TRUE(hears(registry_, 10, kFirst, 0.0));
    EXPECT_TRUE(hears(registry_, 10, kSecond, 2.0));
    if (leaves == kSecond) {
      EXPECT_TRUE(hears(registry_, 10, kFirst, 3.0));
    }
    EXPECT_EQ(hears(registry_, 11, leaves, 4.0), leaves == kFirst);
    EXPECT_EQ(owner(kOne), leaves == kFirst ? 11U : 10U);
    EXPECT_EQ(hears(registry_, 10, leaves == kFirst ? kSecond : kFirst, 5.0), leaves == kSecond);
  }
}

TEST_F(Registry, ALateStatusOfTheStartBeforeMakesNoSecondProgram) {
  constexpr std::uint64_t kBefore = (5ULL << 32U) + 4, kStart = (9ULL << 32U) + 5;
  EXPECT_TRUE(hears(registry_, 10, kBefore, 0.0));
  EXPECT_TRUE(hears(registry_, 10, kStart, 2.0));
  EXPECT_TRUE(hears(registry_, 10, kBefore, 2.1));
  for (int i = 0; i < 10; ++i) EXPECT_TRUE(hears(registry_, 10, kStart, 4.0 + i));
  EXPECT_TRUE(hears(registry_, 11, kStart, 15.0));
}

TEST_F(Registry, AfterThirtySecondsANewSessionTakesItsPlaceForGood) {
  hear(kOne, "alpha", 10, 0);
  EXPECT_FALSE(hear(kOne, "alpha", 11, 29.9));
  EXPECT_TRUE(hear(kOne, "alpha", 11, 30.1));
  for (const double s : {31.0, 40.0, 1000.0}) {  // whether the newer one is there or not
    EXPECT_FALSE(hear(kOne, "alpha", 10, s));
    EXPECT_NE(why_.find("session 10 of robot 'alpha' has been replaced by session 11"), std::string::npos) << why_;
  }
  EXPECT_EQ(owner(kOne), 11U);
  registry_.note_session({kOne, 11});
  EXPECT_FALSE(hear(kOne, "bravo", 12, 1000));  // a number with submaps keeps its name
}

TEST_F(Registry, AClaimWithoutSubmapsCountsWhileItIsThereAndYieldsToOneWithSubmaps) {
  EXPECT_TRUE(hear(kOne, "nobody", 99, 0));
  EXPECT_FALSE(hear(kOne, "alpha", 10, 1));
  EXPECT_TRUE(registry_.note_session({kOne, 10}));  // the robot's submaps come all the same
  EXPECT_FALSE(registry_.note_session({kOne, 10}));
  EXPECT_TRUE(hear(kOne, "alpha", 10, 2));
  EXPECT_FALSE(hear(kOne, "nobody", 99, 1000));
  EXPECT_FALSE(hear(kOne, "nobody", 98, 1000));
  EXPECT_TRUE(hear(kTwo, "nobody", 99, 1000));
  EXPECT_FALSE(hear(kTwo, "bravo", 11, 1029));
  EXPECT_TRUE(hear(kTwo, "bravo", 11, 1031));
  EXPECT_TRUE(hear(kOne, "alpha", 66, 2000));  // somebody who knows its name, while it is out of range
  EXPECT_TRUE(hear(kOne, "alpha", 10, 2001));
  EXPECT_EQ(owner(kOne), 10U);
}

TEST_F(Registry, StrangersAreBoundedNotStoredAndBlockNobody) {
  registry_.note_session({kOne, 10});
  for (std::uint32_t i = 0; i < 1200; ++i) {
    const auto heard = registry_.hear({100 + i}, status("fake_" + std::to_string(i), 1), at(i * 0.001));
    EXPECT_TRUE(heard.accepted);
    EXPECT_FALSE(heard.must_be_stored);
  }
  EXPECT_TRUE(registry_.hear(kOne, status("alpha", 10), at(2)).must_be_stored);
  EXPECT_TRUE(hear(kTwo, "bravo", 11, 2));
  EXPECT_EQ(registry_.robots().size(), RobotRegistry::kMostStrangers + 1);
  EXPECT_TRUE(registry_.robots().contains(kTwo));
}

TEST_F(Registry, WhatLiesInTheMapIsOlderThanWhoeverComesFirst) {
  registry_.note_session({kOne, 99});
  EXPECT_EQ(registry_.owner(kOne), std::nullopt);
  EXPECT_TRUE(hear(kOne, "alpha", 10, 0));  // its clock is behind that of its last start
  registry_.note_session({kOne, 10});
  EXPECT_FALSE(hear(kOne, "alpha", 99, 500));
  EXPECT_EQ(owner(kOne), 10U);
}

TEST_F(Registry, YesterdaysOwnerDoesNotKeepTodaysOut) {
  hear(kOne, "alpha", 10, 0);
  hear(kOne, "alpha", 66, 1);  // refused
  restart(1000);
  EXPECT_EQ(owner(kOne), 10U);
  EXPECT_FALSE(hear(kOne, "alpha", 66, 1001));  // whoever was refused is not the first after the server's restart
  EXPECT_TRUE(hear(kOne, "alpha", 20, 1001));
  EXPECT_FALSE(hear(kOne, "alpha", 10, 1100));
  restart(2000);
  EXPECT_FALSE(hear(kOne, "alpha", 10, 2100));
  EXPECT_TRUE(hear(kOne, "alpha", 66, 2100));
}

TEST_F(Registry, RowsThatAreDamagedAreNotTaken) {
  hear(kOne, "alpha", 10, 0);
  hear(kOne, "alpha", 11, 40);
  const std::string row = registry_.row(kOne);
  RobotRegistry fresh;
  for (std::size_t size = 0; size < row.size() - 4; ++size) EXPECT_FALSE(fresh.restore(kOne, row.substr(0, size)));
  EXPECT_FALSE(fresh.restore(kOne, row + "\n"));
  EXPECT_TRUE(fresh.restore(kOne, row));
  EXPECT_EQ(fresh.row(kOne), row);
  EXPECT_EQ(RobotRegistry::robot_of(RobotRegistry::key(kTwo)), kTwo);
  for (const char* key : {"map", "robot/", "robot/x", "robot/1 ", "robot/-1"})
    EXPECT_FALSE(RobotRegistry::robot_of(key)) << key;
}

/// Whatever programs send and however often the server starts again: a session that has lost its place never has it
/// again, and only one that was not heard for 30 s loses it. (All are strangers, or none is.)
RC_GTEST_PROP(RegistryProperty, OwnersChangeOnlyWhenTheyAreGoneAndNeverBack, ()) {
  RobotRegistry registry;
  registry.start(at(0));
  const bool are_mapped = *rc::gen::element(false, true);
  const auto map_all = [&] {
    for (std::uint64_t session = 0; are_mapped && session < 6; ++session) registry.note_session({kOne, session});
  };
  double now = 0.0;
  std::vector<std::uint64_t> owners;
  double owner_seen = -1.0;  // since the last start; negative: not
  for (int step = 0; step < 60; ++step) {
    now += *rc::gen::element(1.0, 10.0, 31.0);
    if (*rc::gen::inRange(0, 10) == 0 && !owners.empty()) {
      RobotRegistry fresh;
      fresh.start(at(now));
      RC_ASSERT(fresh.restore(kOne, registry.row(kOne)));
      registry = fresh;
      map_all();
      owner_seen = -1.0;
    }
    const auto session = *rc::gen::inRange<std::uint64_t>(0, 6);
    const bool accepted = registry.hear(kOne, status("alpha", session), at(now)).accepted;
    const std::uint64_t owner = registry.owner(kOne)->session;
    RC_ASSERT(accepted == (owner == session));
    if (owners.empty() || owners.back() != owner) {
      RC_ASSERT(std::ranges::find(owners, owner) == owners.end());
      RC_ASSERT(owner_seen < 0.0 || now - owner_seen >= RobotRegistry::kOwnerIsThere_s);
      owners.push_back(owner);
    }
    if (accepted) owner_seen = now;
  }
}

}  // namespace robot_registry_test
}  // namespace tutti::node
