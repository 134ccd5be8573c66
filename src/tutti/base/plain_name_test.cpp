// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/plain_name.hpp"

#include <gtest/gtest.h>

#include <string>

namespace tutti {
namespace plain_name_test {

TEST(PlainName, HasOneToManyLettersDigitsUnderscoresAndHyphens) {
  for (const char* name : {"a", "Z", "9", "_", "-", "alpha_2-B"}) EXPECT_TRUE(is_plain_name(name, 9)) << name;
  for (const char* name : {"", "al pha", "a.b", "a/b", "a*", ">", "\xc3\xa4", "ten_letters"})
    EXPECT_FALSE(is_plain_name(name, 9)) << name;
}

TEST(PlainName, AllowsSixtyFourBytesOfAll) {
  int allowed = 0;
  for (int c = 0; c < 256; ++c) allowed += is_plain(static_cast<char>(c)) ? 1 : 0;
  EXPECT_EQ(allowed, 26 + 26 + 10 + 2);
}

}  // namespace plain_name_test
}  // namespace tutti
