// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/nearest_word.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace tutti {
namespace nearest_word_test {

TEST(NearestWord, IsTheOneWithTheFewestOtherLetters) {
  const std::vector<std::string> known{"export", "eval", "map", "demo", "settings"};
  EXPECT_EQ(nearest_word("expotr", known), "export");
  EXPECT_EQ(nearest_word("setings", known), "settings");
  EXPECT_EQ(nearest_word("maps", known), "map");
  EXPECT_EQ(nearest_word("Demo", known), "demo");
}

TEST(NearestWord, IsNoneWhereNoneIsNear) {
  EXPECT_EQ(nearest_word("dance", std::vector<std::string>{"demo", "map"}), std::nullopt);
  EXPECT_EQ(nearest_word("a", {}), std::nullopt);
}

}  // namespace nearest_word_test
}  // namespace tutti
