// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/utc_text.hpp"

#include <gtest/gtest.h>

#include <cstdint>

namespace tutti {
namespace utc_text_test {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

TEST(UtcTextTest, LaterTimesAreGreaterTexts) {
  EXPECT_EQ(utc_text(0), "1970-01-01 00:00:00 UTC");
  EXPECT_EQ(utc_text(1'700'000'000 * kSecond_ns), "2023-11-14 22:13:20 UTC");
  for (const std::int64_t s : {999'999'999, 1'700'000'000, 1'798'761'599})
    EXPECT_LT(utc_text(s * kSecond_ns), utc_text((s + 1) * kSecond_ns));
}

}  // namespace utc_text_test
}  // namespace tutti
