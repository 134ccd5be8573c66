// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/history/history_file.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <fstream>

#include "tutti/base/file.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::history {
namespace history_file_test {

namespace fs = std::filesystem;

class HistoryFile : public ::testing::Test {
 protected:
  HistoryFile() { fs::create_directories(folder_); }
  ~HistoryFile() override { fs::remove_all(folder_); }
  /// Statuses of so many seconds, and a mark.
  void fill(int seconds) const {
    const auto opened = open_history(file_);
    ASSERT_EQ(opened.said, "");
    for (int i = 0; i < seconds; ++i)
      ASSERT_TRUE(opened.history->put(std::vector<Message>{
          {"status", 1.0 * i, "{\"revision\":" + std::to_string(i) + "}"}, {"mark/1", 1.0 * i, std::to_string(i)}}));
  }
  fs::path folder_ = fs::path(::testing::TempDir()) / ("history_" + std::to_string(getpid()));
  fs::path file_ = folder_ / "page" / kHistoryFile;
};

TEST_F(HistoryFile, SurvivesItsProgram) {
  fill(50);
  const auto opened = open_history(file_);
  EXPECT_EQ(opened.said, "");
  EXPECT_EQ(opened.history->last().back().time_s, 49.0);
  EXPECT_EQ(opened.history->known().first_s, 0.0);
}

/// Everything that put() has stored is there, wherever the program was killed.
TEST_F(HistoryFile, SurvivesAKill) {
  for (int round = 0; round < 5; ++round) {
    std::array<int, 2> ends{};
    ASSERT_EQ(pipe(ends.data()), 0);
    const pid_t writer = fork();
    if (writer == 0) {
      const auto opened = open_history(file_);
      for (int i = 0;; ++i) {
        if (!opened.history->put(std::vector<Message>{{"status", 1000.0 * round + i, std::to_string(i)}})) _exit(1);
        if (write(ends[1], &i, sizeof i) != sizeof i) _exit(1);
      }
    }
    close(ends[1]);
    int stored = -1;
    while (stored < 20 + 7 * round && read(ends[0], &stored, sizeof stored) == sizeof stored) {
    }
    kill(writer, SIGKILL);
    waitpid(writer, nullptr, 0);
    for (int more = 0; read(ends[0], &more, sizeof more) == sizeof more;) stored = more;
    close(ends[0]);
    const auto opened = open_history(file_);
    EXPECT_EQ(opened.said, "");
    EXPECT_GE(opened.history->last().back().time_s, 1000.0 * round + stored);
    EXPECT_EQ(opened.history->known().gaps.size(), static_cast<std::size_t>(round));
  }
}

TEST_F(HistoryFile, OneThatIsDamagedIsSetAside) {
  for (const char* damage : {"first page", "cut", "nonsense", "empty"}) {
    fs::remove_all(folder_);
    fill(400);
    const std::string what = damage;
    const auto size = fs::file_size(file_);
    if (what == "cut") fs::resize_file(file_, size / 2);
    if (what == "empty") fs::resize_file(file_, 0);
    if (what == "first page")
      std::fstream(file_, std::ios::in | std::ios::out).write(std::string(4096, 'x').data(), 4096);
    if (what == "nonsense") std::ofstream(file_) << "no store";
    auto opened = open_history(file_);
    EXPECT_NE(opened.said.find("is set aside as"), std::string::npos) << damage << ": " << opened.said;
    EXPECT_TRUE(fs::exists(file_.string() + ".aside")) << damage;
    EXPECT_TRUE(opened.history->last().empty());
    EXPECT_TRUE(opened.history->put(std::vector<Message>{{"status", 1000.0, "{}"}}));
    opened.history.reset();
    opened = open_history(file_);
    EXPECT_EQ(opened.said, "") << damage;
    EXPECT_EQ(opened.history->last().size(), 1U);
  }
}

TEST_F(HistoryFile, OneOfANewerVersionIsSetAsideWhole) {
  storage::Schema newer = schema();
  newer.version = 7;
  newer.tables.emplace_back("later");
  fs::create_directories(file_.parent_path());
  {
    const auto written = storage::open_sqlite_store(file_, newer);
    ASSERT_TRUE(written) << written.error().message;
    for (int i = 0; i < 10; ++i)
      ASSERT_TRUE((*written)->commit(std::vector<storage::Write>{{"rows", std::to_string(i), "of a newer program"}}));
  }
  const auto opened = open_history(file_);
  EXPECT_NE(opened.said.find("version 7"), std::string::npos) << opened.said;
  EXPECT_TRUE(opened.history->put(std::vector<Message>{{"status", 1.0, "{}"}}));
  EXPECT_EQ(opened.history->last().size(), 1U);
  const auto aside = storage::open_sqlite_store(file_.string() + ".aside", newer);
  ASSERT_TRUE(aside) << aside.error().message;
  std::size_t rows = 0;
  ASSERT_TRUE((*aside)->sizes("rows", [&](std::string_view, std::size_t) { ++rows; }));
  EXPECT_EQ(rows, 10U);
}

/// One row is lost, and no more.
TEST_F(HistoryFile, ADamagedRowIsLeftOut) {
  fill(5);
  std::string bytes = read_file(file_.string()).value();
  const std::size_t at = bytes.find("{\"revision\":2}");
  ASSERT_NE(at, std::string::npos);
  bytes[at + 1] = 'x';
  std::ofstream(file_, std::ios::binary) << bytes;
  const auto opened = open_history(file_);
  EXPECT_EQ(opened.said, "");
  EXPECT_EQ(opened.history->last().size() + opened.history->past().size(), 9U);
  EXPECT_EQ(opened.history->lost(), 1U);
}

TEST_F(HistoryFile, WithoutAPlaceItIsInMemoryAndSaysSo) {
  std::ofstream(folder_ / "page") << "a file where the folder would be";
  const auto opened = open_history(file_);
  EXPECT_NE(opened.said.find("in memory only"), std::string::npos) << opened.said;
  EXPECT_TRUE(opened.history->put(std::vector<Message>{{"status", 1.0, "{}"}}));
  EXPECT_EQ(opened.history->last().size(), 1U);
  EXPECT_EQ(open_history({}).said, "");
}

TEST_F(HistoryFile, TwoProgramsDoNotShareOne) {
  const auto first = open_history(file_);
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  const pid_t other = fork();
  if (other == 0) _exit(open_history(file_).said.find("is open in another program") != std::string::npos ? 0 : 1);
  int status = 1;
  waitpid(other, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_FALSE(fs::exists(file_.string() + ".aside"));
}

}  // namespace history_file_test
}  // namespace tutti::history
