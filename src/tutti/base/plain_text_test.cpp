// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/plain_text.hpp"

#include <gtest/gtest.h>

namespace tutti {
namespace {

TEST(PlainText, WhatIsNoPrintableAsciiBecomesAQuestionMarkAndTheRestIsCut) {
  EXPECT_EQ(plain_text("a\x1b[2J\n\xc3\xa4 b\x7f"), "a?[2J??? b?");
  EXPECT_EQ(plain_text(std::string(2000, 'a')).size(), kPlainTextBytes);
  EXPECT_EQ(plain_text("abc", 2), "ab");
  EXPECT_EQ(plain_text(""), "");
}

}  // namespace
}  // namespace tutti
