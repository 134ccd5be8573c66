// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/refused_rows.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <future>
#include <iterator>

#include "tutti/storage/map_tables.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::node {
namespace refused_rows_test {

/// One refusal between each two robots.
Verdicts job_of(std::uint32_t robots, const std::string& name) {
  Verdicts out{.job = name};
  for (std::uint32_t a = 0; a < robots; ++a)
    for (std::uint32_t b = a + 1; b < robots; ++b)
      out.verdicts.push_back(
          {.pair = {{{RobotId{a}, 1}, 0}, {{RobotId{b}, 1}, 0}}, .refusal = Refusal{RefusalReason::overlap, 0.1, 0.3}});
  return out;
}

std::size_t looked_at(const storage::TableStore& store, std::uint32_t a, std::uint32_t b, std::size_t& found) {
  found = 0;
  const auto rows = read_refusals(store, RobotId{a}, RobotId{b}, [&](const SubmapPair&, const Refusal&) { ++found; });
  EXPECT_TRUE(rows.has_value());
  return rows.value_or(0);
}

TEST(RefusedRows, LooksOnlyAtRowsOfTheTwoRobots) {
  storage::MemoryStore store(storage::map_schema());
  for (int job = 0; job < 100; ++job)
    ASSERT_TRUE(store.commit(rows_of_refusals(job_of(10, fmt::format("7/{}", job)))).has_value());
  std::size_t found = 0;
  EXPECT_EQ(looked_at(store, 8, 3, found), 100U) << "of 4500 rows";
  EXPECT_EQ(found, 100U);
  looked_at(store, 0, 255, found);
  EXPECT_EQ(found, 0U);
}

/// The reader is at its first refusal, with most rows before it, when a commit is asked for.
TEST(RefusedRows, ACommitGoesOnWhileTheyAreRead) {
  const auto file = std::filesystem::path(testing::TempDir()) / "refused_rows_commit.tutti";
  for (const char* end : {"", "-wal"}) std::filesystem::remove(file.string() + end);
  const auto store = storage::open_sqlite_store(file, storage::map_schema()).value();
  std::vector<storage::Write> rows;
  for (std::size_t job = 0; job < 4 * kRowsAtOnce; ++job)
    std::ranges::copy(rows_of_refusals(job_of(2, fmt::format("7/{}", job))), std::back_inserter(rows));
  ASSERT_TRUE(store->commit(rows).has_value());
  bool is_first = true, has_committed = false;
  std::future<bool> commits;
  const auto read = read_refusals(*store, RobotId{0}, RobotId{1}, [&](const SubmapPair&, const Refusal&) {
    if (!std::exchange(is_first, false)) return;
    commits = std::async(std::launch::async, [&] {
      return store->commit(std::vector<storage::Write>{{map_tables::kMeta, "during", "it"}}).has_value();
    });
    has_committed = commits.wait_for(std::chrono::seconds(20)) == std::future_status::ready && commits.get();
  });
  ASSERT_TRUE(read.has_value()) << read.error().message;
  EXPECT_EQ(*read, rows.size());
  EXPECT_TRUE(has_committed);
}

}  // namespace refused_rows_test
}  // namespace tutti::node
