// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/posted_json.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tutti::page {
namespace posted_json_test {

std::string times(std::size_t count, const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < count; ++i) out += text;
  return out;
}

std::string why_not(const std::string& body) {
  const auto json = posted_json(body);
  return json ? "" : json.error().message;
}

TEST(PostedJson, AnObjectIsTaken) {
  EXPECT_TRUE(posted_json("")->is_object());
  EXPECT_EQ(posted_json(R"({"a":[1,{"b":"c"}]})")->at("a").at(1).at("b"), "c");
  for (const char* bad : {"[]", "7", "{", "{\"a\":}", "\xff", "{\"a\":\"\\"}) EXPECT_NE(why_not(bad), "") << bad;
}

TEST(PostedJson, NestingAndValuesHaveABoundAndStringsHaveNone) {
  const auto nested = [](std::size_t deep) { return "{\"a\":" + times(deep, "[") + times(deep, "]") + "}"; };
  EXPECT_EQ(why_not(nested(kMostNested - 1)), "");
  EXPECT_NE(why_not(nested(kMostNested)).find("nested"), std::string::npos);
  EXPECT_NE(why_not(times(2U << 20U, "[")).find("nested"), std::string::npos);
  EXPECT_NE(why_not(times(2U << 18U, "{\"a\":")).find("nested"), std::string::npos);
  EXPECT_EQ(why_not("{\"a\":[0" + times(kMostSeparators - 1, ",0") + "]}"), "");
  EXPECT_NE(why_not("{\"a\":[0" + times(kMostSeparators, ",0") + "]}").find("commas"), std::string::npos);
  EXPECT_EQ(why_not("{\"a\":\"" + times(10'000, "[,:{\\\"") + "\"}"), "") << "all of it is one string";
  EXPECT_NE(why_not("{\"a\\\\\":" + times(100, "[")).find("nested"), std::string::npos) << "the string has ended";
}

}  // namespace posted_json_test
}  // namespace tutti::page
