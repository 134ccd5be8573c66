// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/content.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "support/mapfile/small_map.hpp"
#include "tutti/base/file.hpp"
#include "tutti/mapfile/salvage.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::mapfile {
namespace content_test {

namespace fs = std::filesystem;

TEST(Content, OfAMapThatIsOpenACopyIsRead) {
  const fs::path folder = fs::path(testing::TempDir()) / ("content_" + std::to_string(getpid()));
  const fs::path file = folder / "map.tutti", temporary = folder / "temporary";
  fs::create_directories(temporary);
  const char* const before = std::getenv("TMPDIR");
  const std::string usual = before == nullptr ? "/tmp" : before;
  setenv("TMPDIR", temporary.c_str(), 1);
  {
    const auto store = storage::open_sqlite_store(file, storage::map_schema(), {.min_free_bytes = 0}).value();
    test::Mapper mapper({RobotId{0}}, *store);
    mapper.walk(ChainId(RobotId{0}, 5));
    const auto refused = open(file);
    ASSERT_FALSE(refused.has_value());
    EXPECT_NE(refused.error().message.find("is open in another program"), std::string::npos);

    const auto copy = open_copy(file);
    ASSERT_TRUE(copy.has_value()) << copy.error().message;
    EXPECT_TRUE(fs::is_empty(temporary));
    const Content content = read(**copy).value();
    EXPECT_EQ(content.submaps.size(), mapper.server().state().submaps.size());
    EXPECT_EQ(estimate(content).graph.poses, mapper.server().map().graph.poses);
  }
  EXPECT_TRUE(open(file).has_value());
  EXPECT_FALSE(open_copy(folder / "none").has_value());
  ASSERT_TRUE(write_file((folder / "text").string(), "no map"));
  EXPECT_EQ(open_copy(folder / "text").error().message.find((folder / "text").string() + ": not an SQLite file"), 0U);
  EXPECT_TRUE(fs::is_empty(temporary));
  setenv("TMPDIR", usual.c_str(), 1);
  fs::remove_all(folder);
}

TEST(Content, OfABagIsNamedWithTheCommandThatMakesAMap) {
  const fs::path folder = fs::path(testing::TempDir()) / ("content_of_a_bag_" + std::to_string(getpid()));
  const fs::path bag = folder / "a.mcap";
  fs::create_directories(folder);
  ASSERT_TRUE(write_file(bag.string(), "\x89MCAP0\r\n and so on"));
  for (const auto& asked : {open(bag).error().message, open_copy(bag).error().message,
                            salvage(bag, folder / "out.tutti", 0).error().message})
    EXPECT_NE(asked.find("a.mcap: is a recording, expected a map of Tutti's (.tutti): tutti run " + bag.string()),
              std::string::npos)
        << asked;
  EXPECT_NE(open(folder).error().message.find("is a folder, expected a map of Tutti's (.tutti): tutti map list"),
            std::string::npos);
  fs::remove_all(folder);
}

}  // namespace content_test
}  // namespace tutti::mapfile
