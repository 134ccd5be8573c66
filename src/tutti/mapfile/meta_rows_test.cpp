// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/meta_rows.hpp"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "support/mapfile/small_map.hpp"
#include "tutti/mapfile/hold_map.hpp"
#include "tutti/node/meta_keys.hpp"

namespace tutti::mapfile {
namespace meta_rows_test {

TEST(MetaRows, EveryRowThatAServerWritesHasALine) {
  storage::MemoryStore store(storage::map_schema());
  test::Mapper mapper({RobotId{0}, RobotId{1}}, store);
  for (const std::uint32_t robot : {0U, 1U}) mapper.walk({RobotId{robot}, 5});
  mapper.update();
  ASSERT_TRUE(hold_map(store, 1'000).has_value());
  std::set<std::string_view> met;
  const auto tables = store.tables();
  for (const auto& [key, bytes] : tables.at(map_tables::kMeta)) {
    met.insert(meta_row(key).key);
    EXPECT_NE(meta_row(key).key, "") << key;
  }
  for (const auto key : {node::kMapKey, node::kSettingsKey, node::kHeldPrefix, node::kVersionPrefix})
    EXPECT_TRUE(met.contains(key)) << key;
}

TEST(MetaRows, PrefixesAreNotKeys) {
  EXPECT_EQ(meta_row("held/12").of, MetaRow::Of::submap);
  EXPECT_EQ(meta_row("map").key, node::kMapKey);
  EXPECT_EQ(meta_row("map/12").key, "");
  EXPECT_EQ(meta_row("counts2").key, "");
  EXPECT_FALSE(meta_row("of a newer program").merge_drops);
}

}  // namespace meta_rows_test
}  // namespace tutti::mapfile
