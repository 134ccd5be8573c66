// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/why.hpp"

#include <gtest/gtest.h>

#include "support/mapfile/small_map.hpp"
#include "tutti/node/refused_rows.hpp"

namespace tutti::mapfile {
namespace why_test {

const RobotId kAlpha{0}, kBravo{1};

class WhyNot : public testing::Test {
 protected:
  WhyNot() {
    test::Mapper mapper({kAlpha, kBravo}, store_);
    mapper.walk({kAlpha, 5});
    mapper.walk({kBravo, 5});
  }
  Content content() {
    Content out = read(store_).value();
    out.names = {{kAlpha, "alpha"}, {kBravo, "bravo"}};
    return out;
  }
  /// Stores a verifier's refusal, its answer instead of closures.
  void refuse(std::uint32_t a, std::uint32_t b, const Refusal& refusal) {
    Verdicts answer{.job = fmt::format("{}/{}", a, b)};
    answer.verdicts.push_back({.pair = {{{kAlpha, 5}, a}, {{kBravo, 5}, b}}, .refusal = refusal});
    EXPECT_TRUE(store_.commit(node::rows_of_refusals(answer)).has_value());
  }
  Result<WhyNotJoined> ask(const Content& content, const std::string& a = "alpha", const std::string& b = "bravo") {
    return why_not_joined(store_, content, estimate(content), a, b);
  }
  storage::MemoryStore store_{storage::map_schema()};
};

TEST_F(WhyNot, SaysThatTheyAreJoinedWhenTheyAre) {
  const auto why = ask(content());
  ASSERT_TRUE(why.has_value()) << why.error().message;
  EXPECT_TRUE(why->is_joined);
  EXPECT_GT(why->accepted, 0U);
  EXPECT_NE(why->sentence.find("are merged"), std::string::npos) << why->sentence;
}

TEST_F(WhyNot, TheNearestIsWhatWasStoppedLastAndByLeast) {
  Content apart = content();
  apart.verdicts.clear();
  refuse(0, 1, {RefusalReason::overlap, 0.28, 0.3});
  refuse(0, 2, {RefusalReason::overlap, 0.10, 0.3});
  refuse(1, 3, {RefusalReason::unlike_from_above});
  refuse(2, 2, {RefusalReason::ambiguous_along, 0.95, 0.65});
  refuse(3, 3, {RefusalReason::ambiguous, 0.95, 0.75});  // rivals are compared before anything else is measured
  const auto why = ask(apart, "bravo", "alpha");
  ASSERT_TRUE(why.has_value()) << why.error().message;
  EXPECT_FALSE(why->is_joined);
  std::vector<std::string> names;
  for (const NearMiss& miss : why->nearest)
    if (miss.refusal.reason != RefusalReason::no_alignment) names.push_back(miss.name);
  ASSERT_GE(names.size(), 5U);
  names.resize(5);
  EXPECT_EQ(names, (std::vector<std::string>{"alpha/2-bravo/2", "alpha/0-bravo/1", "alpha/0-bravo/2", "alpha/3-bravo/3",
                                             "alpha/1-bravo/3"}));
  EXPECT_NE(why->sentence.find("ambiguous"), std::string::npos) << why->sentence;
  EXPECT_EQ(why->stopped_by.at("overlap"), 2U);
  EXPECT_NE(why->nearest.front().hint.find("crossing"), std::string::npos);
}

TEST_F(WhyNot, WhatTheMapContradictsIsNearest) {
  Content doubted = content();
  std::size_t rejected = 0;
  for (const ClosureInfo& info : closures(doubted, estimate(doubted)))
    if (info.pair.first.chain.robot != info.pair.second.chain.robot && info.state == ClosureState::rejected) ++rejected;
  ASSERT_GT(rejected, 0U);
  refuse(0, 1, {RefusalReason::image_spread, 0.28, 0.3});
  const auto why = ask(doubted);
  ASSERT_TRUE(why.has_value());
  EXPECT_EQ(why->nearest.front().refusal.reason, RefusalReason::inconsistent);
}

TEST_F(WhyNot, AStrangerOrOneRobotTwiceIsAnError) {
  EXPECT_NE(ask(content(), "alpha", "mallory").error().message.find("'mallory'"), std::string::npos);
  EXPECT_FALSE(ask(content(), "alpha", "alpha").has_value());
}

TEST(Hints, EveryReasonHasOne) {
  for (std::size_t i = 0; i < kRefusalKinds.size(); ++i) EXPECT_FALSE(hint_for(static_cast<RefusalReason>(i)).empty());
}

}  // namespace why_test
}  // namespace tutti::mapfile
