// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/base64.hpp"

#include <gtest/gtest.h>

namespace tutti::page {
namespace base64_test {

TEST(Base64, IsThatOfTheStandard) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xff\xff"), "////");
}

TEST(Base64, IsReadBack) {
  for (const char* text : {"", "f", "fo", "foo", "foobar", "\xff\x01\x80"})
    EXPECT_EQ(bytes_of_base64(base64(text)), text);
  EXPECT_FALSE(bytes_of_base64("Zm9v!").has_value());
}

}  // namespace base64_test
}  // namespace tutti::page
