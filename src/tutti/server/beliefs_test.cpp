// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/beliefs.hpp"

#include <gtest/gtest.h>

namespace tutti::server {
namespace beliefs_test {

const ChainId kAlpha{RobotId{0}, 1}, kBravo{RobotId{1}, 1}, kCharlie{RobotId{2}, 1};

JudgedClosure judged(const ChainId& from, const ChainId& to, std::uint32_t index, bool accepted) {
  return {.closure = {{from, index}, {to, index}, {}}, .accepted = accepted};
}

TEST(Beliefs, EveryDifferenceIsCountedOnceAndOnItsOwnSide) {
  MapEstimate older, newer;
  older.closures = {judged(kAlpha, kBravo, 1, true), judged(kAlpha, kBravo, 2, false), judged(kAlpha, kBravo, 3, true)};
  newer.closures = {judged(kAlpha, kBravo, 1, false), judged(kAlpha, kBravo, 2, true), judged(kAlpha, kBravo, 3, true),
                    judged(kAlpha, kAlpha, 4, true), judged(kBravo, kCharlie, 5, true)};
  older.failed_odometry = {{kAlpha, 10, 20}, {kAlpha, 40, 50}, {kBravo, 1, 2}};
  newer.failed_odometry = {{kAlpha, 12, 19}, {kAlpha, 60, 70}};
  const ChangeReason reason = reason_of_change(beliefs_of(older), beliefs_of(newer), kAlpha);
  EXPECT_EQ(reason,
            (ChangeReason{.found = 1, .taken_up = 1, .dropped = 1, .failed = 1, .recovered = 1, .elsewhere = 1}));
  EXPECT_EQ(to_string(reason),
            "1 of its closures are new, 1 of its closures that were refused are accepted, 1 of its closures that were "
            "accepted are refused, 1 segments of its odometry are taken to have failed, 1 segments of its odometry are "
            "believed again");
  EXPECT_EQ(reason_of_change(beliefs_of(newer), beliefs_of(newer), kAlpha), ChangeReason{});
  EXPECT_EQ(to_string(ChangeReason{.elsewhere = 3}), "3 closures of other robots changed");
}

}  // namespace beliefs_test
}  // namespace tutti::server
