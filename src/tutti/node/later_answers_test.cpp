// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/later_answers.hpp"

#include <gtest/gtest.h>

namespace tutti::node {
namespace later_answers_test {

constexpr Timestamp kRobots{1'670'403'892'357'527'971};  // robots' clock at 100 s of ours
constexpr Timestamp kHere{100'000'000'000};

ClosureVerdict verdict(std::uint32_t first, std::size_t closures) {
  ClosureVerdict out{.pair = {{ChainId{RobotId{0}, 0}, first}, {ChainId{RobotId{1}, 0}, 0}}};
  for (std::size_t i = 0; i < closures; ++i)
    out.closures.push_back({{RobotId{0}, static_cast<std::uint32_t>(i)}, {RobotId{1}, 0}, {}});
  return out;
}

TEST(LaterAnswers, AnswerEachTimeWithAllThatIsKnownAndTheJobAtTheEnd) {
  LaterAnswers later;
  later.note_newest(kRobots, kHere);
  later.add("1/0", verdict(7, 3), {kRobots - 3.0, kRobots + 20.0, kRobots + 60.0});
  later.add("1/0", verdict(8, 1), {kRobots + 20.0});
  EXPECT_TRUE(later.has("1/0"));
  auto now = later.take_due(kHere);
  ASSERT_EQ(now.size(), 1U);
  EXPECT_NE(now[0].job, "1/0");
  ASSERT_EQ(now[0].verdicts.size(), 1U);
  EXPECT_EQ(now[0].verdicts[0], verdict(7, 1));
  EXPECT_EQ(later.next_due(), kHere + 20.0);
  EXPECT_TRUE(later.take_due(kHere + 19.999).empty());
  const std::string before = now[0].job;
  now = later.take_due(kHere + 20.0);
  ASSERT_EQ(now.size(), 1U);
  EXPECT_NE(now[0].job, "1/0");
  EXPECT_NE(now[0].job, before);  // a bus passes a name on once
  EXPECT_EQ(now[0].verdicts, (std::vector{verdict(7, 2), verdict(8, 1)}));
  now = later.take_due(kHere + 3600.0);
  ASSERT_EQ(now.size(), 1U);
  EXPECT_EQ(now[0].job, "1/0");
  EXPECT_EQ(now[0].verdicts, std::vector{verdict(7, 3)});
  EXPECT_FALSE(later.next_due());
  EXPECT_FALSE(later.has("1/0"));
}

TEST(LaterAnswers, SendNothingBeforeItIsKnownHoweverTheSubmapsCome) {
  LaterAnswers later;
  later.note_newest(kRobots, kHere + 300.0);  // it came late: no radio
  later.add("1/0", verdict(7, 1), {kRobots + 20.0});
  EXPECT_EQ(later.next_due(), kHere + 320.0);
  later.note_newest(kRobots + 5.0, kHere + 5.0);
  EXPECT_EQ(later.next_due(), kHere + 20.0);
  later.note_newest(kRobots + 6.0, kHere + 400.0);
  EXPECT_EQ(later.next_due(), kHere + 20.0);
}

}  // namespace later_answers_test
}  // namespace tutti::node
