// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/history/packing.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace tutti::history {
namespace packing_test {

RC_GTEST_PROP(Packing, GivesBackWhatItGot, (const std::string& text)) {
  RC_ASSERT(unpacked(packed(text)).value() == text);
  std::string long_text;
  for (int i = 0; i < 20; ++i) long_text += text + "{\"name\":\"alpha\"}";
  RC_ASSERT(unpacked(packed(long_text)).value() == long_text);
  RC_ASSERT(packed(text).size() <= text.size() + 1);
}

RC_GTEST_PROP(Packing, AnyBytesAreAValueOrAnError, (const std::string& bytes)) {
  for (const char* head : {"", "z", "p"}) static_cast<void>(unpacked(head + bytes));
}

TEST(Packing, ACutValueIsAnError) {
  const std::string whole = packed(std::string(1000, 'a'));
  for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_FALSE(unpacked(whole.substr(0, size))) << size;
}

}  // namespace packing_test
}  // namespace tutti::history
