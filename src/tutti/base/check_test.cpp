// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/check.hpp"

#include <gtest/gtest.h>

#include "tutti/base/result.hpp"

namespace tutti {
namespace check_test {

TEST(Check, SaysConditionPlaceAndMessage) {
  const int n = -1;
  try {
    TUTTI_CHECK(n > 0, "n = {}", n);
    FAIL() << "did not throw";
  } catch (const std::logic_error& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("check_test.cpp:"), std::string::npos) << text;
    EXPECT_NE(text.find("n > 0"), std::string::npos) << text;
    EXPECT_NE(text.find("n = -1"), std::string::npos) << text;
  }
}

TEST(Check, EvaluatesTheMessageOnlyWhenBroken) {
  int evaluated = 0;
  EXPECT_NO_THROW(TUTTI_CHECK(true, "{}", ++evaluated));
  EXPECT_EQ(evaluated, 0);
  EXPECT_THROW(TUTTI_CHECK(false, "{}", ++evaluated), std::logic_error);
  EXPECT_EQ(evaluated, 1);
}

TEST(Check, NeedsNoMessageAndIsOneStatement) {
  if (true)
    EXPECT_THROW(TUTTI_CHECK(1 > 2), std::logic_error);
  else
    TUTTI_CHECK(true);
}

Result<int> half(int n) {
  if (n % 2 != 0) return fail(ErrorCode::invalid, "{} is odd", n);
  return n / 2;
}

TEST(ResultTest, CarriesCodeMessageAndContext) {
  EXPECT_EQ(half(4), 2);
  const auto odd = half(3);
  ASSERT_FALSE(odd);
  const Result<int> outer = in_context("file.txt:3", odd.error());
  EXPECT_EQ(outer.error().code, ErrorCode::invalid);
  EXPECT_EQ(outer.error().message, "file.txt:3: 3 is odd");
}

}  // namespace check_test
}  // namespace tutti
