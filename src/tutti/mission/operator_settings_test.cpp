// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/operator_settings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>

#include "tutti/base/config_io.hpp"
#include "tutti/mission/mission_config.hpp"

namespace tutti::mission {
namespace operator_settings_test {

/// A key that was renamed or removed would vanish from `tutti settings` without a word.
TEST(OperatorSettings, AreSettingsOfAMission) {
  const auto fields = document_config(*std::make_unique<const MissionConfig>());
  std::set<std::string_view> seen;
  for (const auto& [key, meaning] : operator_settings()) {
    const auto field = std::ranges::find(fields, key, &config_internal::FieldDoc::path);
    ASSERT_NE(field, fields.end()) << key;
    EXPECT_FALSE(field->default_value.empty()) << key << " is a list or a group, expected a value";
    EXPECT_TRUE(seen.insert(key).second) << key << " comes twice";
    EXPECT_TRUE(meaning.ends_with('.')) << meaning;
  }
}

TEST(OperatorSettings, AreFewEnoughToRead) {
  EXPECT_GE(operator_settings().size(), 10U);
  EXPECT_LE(operator_settings().size(), 15U);
}

}  // namespace operator_settings_test
}  // namespace tutti::mission
