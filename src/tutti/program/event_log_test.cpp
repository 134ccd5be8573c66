// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/event_log.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tutti/base/file.hpp"

namespace tutti::program {
namespace event_log_test {

namespace fs = std::filesystem;

class EventLogTest : public testing::Test {
 protected:
  void SetUp() override {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  /// Writes lines of some 50 bytes each, into files of 1 kB.
  void write(int first, int count) const {
    const auto log = EventLog::open(folder_, "test", Level::error, 1000);
    ASSERT_TRUE(log.has_value()) << log.error().message;
    for (int i = first; i < first + count; ++i)
      (*log)->write(Json{{"event", "counted"}, {"number", i}, {"word", "plain"}});
  }
  /// The numbers, and how many files are gone.
  [[nodiscard]] std::pair<std::vector<int>, std::uint64_t> read() const {
    std::vector<int> numbers;
    const auto gone = read_events(folder_, [&](const Json& event) {
      if (event.value("event", "") == "counted") numbers.push_back(event.value("number", -1));
    });
    EXPECT_TRUE(gone.has_value());
    return {numbers, gone.value_or(99)};
  }
  fs::path folder_ = fs::path(testing::TempDir()) / ("event_log_" + std::to_string(getpid()));
};

TEST_F(EventLogTest, SaysHowMuchOfItIsGone) {
  write(0, 30);  // two files
  EXPECT_EQ(read().second, 0U);
  EXPECT_EQ(read().first.size(), 30U);
  write(30, 40);
  write(70, 30);
  const auto [numbers, gone] = read();
  EXPECT_GE(gone, 2U);
  ASSERT_FALSE(numbers.empty());
  EXPECT_GT(numbers.front(), 20);
  EXPECT_EQ(numbers.back(), 99);
  EXPECT_EQ(numbers.size(), static_cast<std::size_t>(100 - numbers.front()));
}

TEST_F(EventLogTest, CountsOnWhenItWasKilledAsANewFileBegan) {
  write(0, 70);
  const std::uint64_t gone = read().second;
  ASSERT_GE(gone, 1U);
  fs::rename(folder_ / "events.jsonl", folder_ / "events.1.jsonl");
  write(70, 1);
  EXPECT_EQ(read().second, gone + 1);
}

TEST_F(EventLogTest, WritesThroughNoLink) {
  const fs::path foreign = folder_ / "foreign";
  ASSERT_TRUE(write_file(foreign.string(), "of somebody else"));
  for (const char* name : {"log.txt", "events.jsonl"}) {
    fs::create_symlink(foreign, folder_ / name);
    const auto refused = EventLog::open(folder_, "test", Level::error);
    ASSERT_FALSE(refused.has_value()) << name;
    EXPECT_NE(refused.error().message.find(name), std::string::npos) << refused.error().message;
    fs::remove(folder_ / name);
  }
  EXPECT_EQ(read_file(foreign.string()).value(), "of somebody else");
}

}  // namespace event_log_test
}  // namespace tutti::program
