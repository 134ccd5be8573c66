// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/internal/text.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include "support/formats/mutations.hpp"

namespace tutti::formats::internal {
namespace text_test {

RC_GTEST_PROP(Seconds, EveryNanosecondSurvivesText, ()) {
  const Timestamp stamp{*rc::gen::inRange<std::int64_t>(-kMaxStampNs, kMaxStampNs)};
  RC_ASSERT(parse_seconds(to_seconds(stamp)) == stamp);
}

RC_GTEST_PROP(Seconds, ExponentMovesThePoint, ()) {
  const auto ns = *rc::gen::inRange<std::int64_t>(-kMaxStampNs, kMaxStampNs);
  const int shift = *rc::gen::inRange(0, 30);
  RC_ASSERT(parse_seconds(fmt::format("{}{}e-{}", ns, std::string(static_cast<std::size_t>(shift), '0'), 9 + shift)) ==
            Timestamp{ns});
  RC_ASSERT(parse_seconds(fmt::format(
                "{}0.{}{}E{}", ns < 0 ? "-" : "", std::string(static_cast<std::size_t>(shift), '0'), std::abs(ns),
                std::to_string(std::abs(ns)).size() + static_cast<std::size_t>(shift) - 9)) == Timestamp{ns});
}

TEST(Seconds, KnownTexts) {
  EXPECT_EQ(parse_seconds("1403636580.838555648"), Timestamp{1403636580838555648});
  EXPECT_EQ(parse_seconds("1.403636580838555574e+09"), Timestamp{1403636580838555574});
  EXPECT_EQ(parse_seconds("1577836980.0991046"), Timestamp{1577836980099104600});
  EXPECT_EQ(parse_seconds("-.5"), Timestamp{-500000000});
  EXPECT_EQ(parse_seconds("+7."), Timestamp{7000000000});
  EXPECT_EQ(parse_seconds("0.00000000049"), Timestamp{0});
  EXPECT_EQ(parse_seconds("0.0000000005"), Timestamp{1});
  EXPECT_EQ(parse_seconds("-0.0000000005"), Timestamp{-1});
  EXPECT_EQ(parse_seconds("5e-10"), Timestamp{1});
  EXPECT_EQ(parse_seconds("9e-11"), Timestamp{0});
  EXPECT_EQ(parse_seconds("0e999999999999"), Timestamp{0});
  EXPECT_EQ(parse_seconds("1e-999999999"), Timestamp{0});
}

TEST(Seconds, WhatIsNoStamp) {
  for (const char* text : {"", ".", "-", "e9", "1e", "1.2.3", "nan", "inf", "0x10", "1 ", "--1", "+-1", "1e1000000000",
                           "2305843009.213693953", "4611686018.427387904", "99999999999999999999", "1,5"})
    EXPECT_FALSE(parse_seconds(text)) << text;
}

TEST(Seconds, RangeEndsAt2To61Nanoseconds) {
  EXPECT_EQ(parse_seconds("2305843009.213693952"), Timestamp{kMaxStampNs});
  EXPECT_EQ(parse_seconds("-2305843009.213693952"), Timestamp{-kMaxStampNs});
  EXPECT_FALSE(parse_seconds("2305843009.2136939525"));  // rounds past the end
}

RC_GTEST_PROP(Seconds, TakesAnyText, (const std::string& text)) { (void)parse_seconds(text); }

TEST(Number, PlusSignsButNoRubbish) {
  EXPECT_EQ(parse_number("+1.5e3"), 1500.0);
  EXPECT_EQ(parse_integer("-12"), -12);
  for (const char* text : {"", "+", "+-1", "1x", "1 2", "1e999"}) EXPECT_FALSE(parse_number(text)) << text;
  for (const char* text : {"", "1.0", "9223372036854775808"}) EXPECT_FALSE(parse_integer(text)) << text;
}

TEST(LineReader, PassesOverAByteOrderMark) {
  LineReader line(
      "\xEF\xBB\xBF"
      "1 2\n\xEF\xBB\xBF 3\n",
      "f");
  ASSERT_TRUE(line.next());
  EXPECT_EQ(line.columns()[0], "1");
  ASSERT_TRUE(line.next());
  EXPECT_EQ(line.columns().size(), 2U);  // only the first counts
  LineReader comment("\xEF\xBB\xBF# head\n4\n", "f");
  ASSERT_TRUE(comment.next());
  EXPECT_EQ(comment.columns()[0], "4");
  EXPECT_FALSE(LineReader("\xEF\xBB\xBF", "f").next());
}

TEST(LineReader, PassesOverCommentsAndEmptyLinesButCountsThem) {
  LineReader line("# head\r\n\r\n 1\t2  3 # tail\r\n\n4", "f");
  ASSERT_TRUE(line.next());
  ASSERT_EQ(line.columns().size(), 3U);
  EXPECT_EQ(line.columns()[2], "3");
  EXPECT_EQ(line.line(), 3);
  ASSERT_TRUE(line.next());
  EXPECT_EQ(line.line(), 5);
  EXPECT_FALSE(line.next());
}

TEST(LineReader, CommasKeepEmptyColumns) {
  LineReader line("1, 2 ,,4,", "f", Separator::comma);
  ASSERT_TRUE(line.next());
  ASSERT_EQ(line.columns().size(), 5U);
  EXPECT_EQ(line.columns()[1], "2");
  EXPECT_EQ(line.columns()[2], "");
  EXPECT_EQ(line.columns()[4], "");
}

TEST(Shown, ShortAndPrintable) {
  EXPECT_EQ(shown("a\x01\xff"),
            "'a?"
            "?'");
  EXPECT_EQ(shown(std::string(50, 'a')), "'" + std::string(40, 'a') + "...'");
}

RC_GTEST_PROP(UnitQuaternion, UnitOnesAreLeftAlone, ()) {
  const Eigen::Quaterniond q = any_pose().rotation;
  RC_ASSERT(to_unit(LineReader("", "f"), q)->coeffs() == q.coeffs());
}

TEST(UnitQuaternion, NormalisedWithinToleranceRefusedBeyond) {
  const Eigen::Quaterniond q(0.5, 0.5, -0.5, 0.5);
  const LineReader where("", "f");
  EXPECT_NEAR(to_unit(where, Eigen::Quaterniond(q.coeffs() * 1.009))->norm(), 1.0, 1e-15);
  EXPECT_FALSE(to_unit(where, Eigen::Quaterniond(q.coeffs() * 1.011)));
  EXPECT_FALSE(to_unit(where, Eigen::Quaterniond(0, 0, 0, 0)));
  EXPECT_FALSE(to_unit(where, Eigen::Quaterniond(1e200, 1e200, 0, 0)));
}

}  // namespace text_test
}  // namespace tutti::formats::internal
