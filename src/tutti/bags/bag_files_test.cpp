// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/bag_files.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <tuple>

#include "support/bags/rosbag2_writer.hpp"
#include "support/shared_data.hpp"
#include "tutti/bags/bag_info.hpp"
#include "tutti/bags/internal/packed_file.hpp"
#include "tutti/bags/rosbag2_metadata.hpp"

namespace tutti::bags {
namespace bag_files_test {

using namespace test;
namespace fs = std::filesystem;

class BagFolders : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / fmt::format("bag_files_{}", getpid());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

struct Read {
  std::vector<std::string> messages;  ///< "topic type stamp data"
  std::vector<BagPosition> positions;
  std::vector<std::string> errors, notes;
};

std::string in_words(const BagMessage& message) {
  return fmt::format("{} {} {} {}", message.channel->topic, message.channel->type, message.log_time.ns, message.data);
}

Read read_all(BagReader& reader) {
  Read out;
  while (true) {
    const auto message = reader.next();
    if (!message) {
      out.errors.push_back(message.error().message);
      continue;
    }
    if (!*message) break;
    out.messages.push_back(in_words(**message));
    out.positions.push_back((*message)->position);
  }
  out.notes = reader.notes();
  return out;
}

/// Eleven and more files of one message show that they are counted, not spelt.
std::vector<Sample> samples() {
  std::vector<Sample> out;
  for (std::uint64_t i = 0; i < 23; ++i)
    out.push_back({i % 3 == 0 ? "/a" : "/b", i % 3 == 0 ? "pkg/msg/A" : "pkg/msg/B", 1000 * i,
                   std::string("\0\1\0\0", 4) + std::string(i, 'x')});
  return out;
}

TEST_F(BagFolders, AreReadAlikeHoweverTheyAreStored) {
  std::vector<std::string> expected;
  for (const Sample& sample : samples())
    expected.push_back(fmt::format("{} {} {} {}", sample.topic, sample.type, sample.ns, sample.data));
  for (const Storage storage : {Storage::mcap, Storage::db3})
    for (const Packing packing : {Packing::none, Packing::whole_files, Packing::messages})
      for (const std::size_t per_file : {std::size_t{100}, std::size_t{2}})
        for (const bool with_metadata : {true, false}) {
          fs::remove_all(folder_);
          write_rosbag2(folder_, samples(), storage, packing, per_file, with_metadata);
          auto bag = open_bag(folder_.string());
          ASSERT_TRUE(bag) << bag.error().message;
          const Read read = read_all(**bag);
          ASSERT_EQ(read.messages, expected) << (*bag)->storage();
          EXPECT_TRUE(read.errors.empty());
          EXPECT_EQ(read.notes.size(), with_metadata ? 0U : 1U);
          EXPECT_EQ((*bag)->channels().size(), 2U);
          EXPECT_EQ((*bag)->stated_messages().has_value(),
                    with_metadata || (per_file == 100 && storage == Storage::mcap));
          for (const std::size_t i : {7, 3, 4, 22, 0}) {
            ASSERT_TRUE((*bag)->seek(read.positions[i]));
            EXPECT_EQ(in_words((*bag)->next().value().value()), expected[i]);
          }
        }
}

TEST_F(BagFolders, AFileThatIsMissingCostsItsMessages) {
  const auto files = write_rosbag2(folder_, samples(), Storage::mcap, Packing::none, 5);
  fs::remove(folder_ / files[1]);
  write_bytes(folder_ / files[3], "no bag");
  write_bytes(folder_ / "other.mcap", "");
  auto bag = open_bag(folder_.string()).value();
  const Read read = read_all(*bag);
  EXPECT_EQ(read.messages.size(), 13U);
  ASSERT_EQ(read.errors.size(), 2U);
  EXPECT_NE(read.errors[0].find("bag_1.mcap: cannot be opened"), std::string::npos) << read.errors[0];
  EXPECT_NE(read.errors[1].find("bag_3.mcap: byte 0: is no MCAP file"), std::string::npos) << read.errors[1];
  ASSERT_EQ(read.notes.size(), 1U);
  EXPECT_NE(read.notes[0].find("other.mcap: is not named by metadata.yaml"), std::string::npos) << read.notes[0];
}

/// Folders are renamed, and files with them; or metadata alone is in a repository.
TEST_F(BagFolders, MetadataThatNamesNoFileThatIsThereIsSaid) {
  const auto files = write_rosbag2(folder_, samples(), Storage::mcap, Packing::none, 100);
  ASSERT_EQ(files.size(), 1U);
  fs::rename(folder_ / files[0], folder_ / "renamed.mcap");
  auto bag = open_bag(folder_.string()).value();
  const Read read = read_all(*bag);
  EXPECT_EQ(read.messages.size(), 23U);
  ASSERT_EQ(read.notes.size(), 1U);
  EXPECT_NE(read.notes[0].find("names bag_0.mcap, which is not there (renamed?)"), std::string::npos) << read.notes[0];
  fs::remove(folder_ / "renamed.mcap");
  const std::string refused = open_bag(folder_.string()).error().message;
  EXPECT_NE(refused.find("names bag_0.mcap, which is not there, nor is another .mcap"), std::string::npos) << refused;
}

TEST_F(BagFolders, WhatSomethingElseHasPackedIsNamedWithWhatToType) {
  fs::create_directories(folder_);
  const auto said = [&](const char* name, const std::string& bytes) {
    write_bytes(folder_ / name, bytes);
    const auto bag = open_bag((folder_ / name).string());
    return bag ? std::string("opened") : bag.error().message;
  };
  for (const auto& [name, bytes, packer, line] :
       {std::tuple{"a.mcap.gz", std::string("\x1f\x8b\x08 and so on"), "gzip", "first: gunzip -k "},
        {"a.tar.gz", std::string("\x1f\x8b\x08 and so on"), "gzip", "first: tar xf "},
        {"a.bag.bz2", std::string("BZh91AY"), "bzip2", "first: bunzip2 -k "},
        {"a.mcap.xz",
         std::string("\xfd"
                     "7zXZ\0\0",
                     7),
         "xz", "first: unxz -k "},
        {"a.zip", std::string("PK\x03\x04\x14"), "zip", "first: unzip "}}) {
    const std::string message = said(name, bytes);
    EXPECT_NE(message.find(std::string("is packed with ") + packer), std::string::npos) << message;
    EXPECT_TRUE(message.ends_with(line + (folder_ / name).string())) << message;
  }
}

TEST_F(BagFolders, BrokenMetadataIsOnlyNoted) {
  write_rosbag2(folder_, samples(), Storage::db3, Packing::none, 5);
  write_bytes(folder_ / "metadata.yaml", "rosbag2_bagfile_information: 3\n");
  auto bag = open_bag(folder_.string()).value();
  const Read read = read_all(*bag);
  EXPECT_EQ(read.messages.size(), 23U);
  ASSERT_EQ(read.notes.size(), 1U);
  EXPECT_NE(read.notes[0].find("expected a map; the files of the folder are read"), std::string::npos) << read.notes[0];
}

TEST_F(BagFolders, WithoutABagAreRefused) {
  EXPECT_NE(open_bag(folder_.string()).error().message.find("expected a bag"), std::string::npos);
  EXPECT_EQ(open_bag((folder_ / "none").string()).error().code, ErrorCode::io);
}

/// The recorder was killed, a disk is going: pages that are there are read, or the error is why not.
TEST_F(BagFolders, SqliteFilesCutAnywhereAreSurvived) {
  std::vector<Sample> many = samples();
  for (Sample& sample : many) sample.data.append(3000, 'y');
  write_db3(folder_ / "whole.db3", many);
  const auto size = fs::file_size(folder_ / "whole.db3");
  ASSERT_GT(size, 60'000U);
  bool partial = false;
  for (std::uintmax_t left = 0; left <= size; left += 1111) {
    fs::copy_file(folder_ / "whole.db3", folder_ / "cut.db3", fs::copy_options::overwrite_existing);
    fs::resize_file(folder_ / "cut.db3", left);
    auto bag = open_bag((folder_ / "cut.db3").string());
    if (!bag) continue;
    const Read read = read_all(**bag);
    EXPECT_EQ(read.errors.size(), read.messages.size() == 23 ? 0U : 1U) << left;
    partial = partial || (!read.messages.empty() && read.messages.size() < 23);
  }
  EXPECT_TRUE(partial);
}

/// As recorders of ROS keep it while they record, and leave it when they are killed.
TEST_F(BagFolders, ASqliteFileIsReadWithItsLogAndWithoutATrace) {
  const fs::path closed = folder_ / "closed.db3", killed = folder_ / "killed.db3";
  write_db3(closed, samples());
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(closed.c_str(), &db), SQLITE_OK);
  sqlite3_exec(db,
               "PRAGMA journal_mode=WAL; INSERT INTO messages(topic_id, timestamp, data) SELECT topic_id, timestamp, "
               "data FROM messages LIMIT 5",
               nullptr, nullptr, nullptr);
  fs::copy_file(closed, killed);
  fs::copy_file(closed.string() + "-wal", killed.string() + "-wal");
  sqlite3_close(db);
  const auto count = [](const fs::path& file) { return read_all(**open_bag(file.string())).messages.size(); };
  EXPECT_EQ(count(closed), samples().size() + 5);
  EXPECT_EQ(count(killed), samples().size() + 5);
  for (const char* end : {"-wal", "-shm"}) EXPECT_FALSE(fs::exists(closed.string() + end)) << end;
}

/// A recorder that keeps a rollback journal was killed in the middle of a transaction whose pages had left its cache.
TEST_F(BagFolders, OfASqliteFileWithAHotJournalItIsReportedHowToReadIt) {
  const fs::path file = folder_ / "recorded.db3", killed = folder_ / "killed.db3";
  write_db3(file, samples());
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &db), SQLITE_OK);
  sqlite3_exec(
      db,
      "PRAGMA journal_mode=DELETE; PRAGMA cache_size=1; BEGIN; UPDATE messages SET data = zeroblob(9000); "
      "INSERT INTO messages(topic_id, timestamp, data) SELECT topic_id, timestamp, zeroblob(9000) FROM messages",
      nullptr, nullptr, nullptr);
  fs::copy_file(file, killed);
  fs::copy_file(file.string() + "-journal", killed.string() + "-journal");
  sqlite3_close(db);
  const auto refused = open_bag(killed.string());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("copy both, open the copy once with `sqlite3 COPY .tables`"),
            std::string::npos)
      << refused.error().message;
  EXPECT_TRUE(fs::exists(killed.string() + "-journal"));
  // Follow the advice.
  ASSERT_EQ(sqlite3_open(killed.c_str(), &db), SQLITE_OK);
  sqlite3_exec(db, "SELECT name FROM sqlite_schema", nullptr, nullptr, nullptr);
  sqlite3_close(db);
  const Read read = read_all(**open_bag(killed.string()));
  EXPECT_EQ(read.messages, read_all(**open_bag(file.string())).messages);
  EXPECT_EQ(read.messages.size(), samples().size());
}

TEST_F(BagFolders, AnEmptySqliteFileIsCalledEmpty) {
  std::ofstream(folder_ / "empty.db3").close();
  const auto bag = open_bag((folder_ / "empty.db3").string());
  ASSERT_FALSE(bag);
  EXPECT_NE(bag.error().message.find("empty.db3: is empty (0 bytes)"), std::string::npos) << bag.error().message;
}

TEST_F(BagFolders, PackedMessagesThatAreBrokenAreLostAlone) {
  std::vector<Sample> some = samples();
  some.resize(3);
  for (Sample& sample : some) sample.data = packed(sample.data, "zstd");
  some[1].data.resize(some[1].data.size() - 2);
  write_db3(folder_ / "a.db3", some);
  auto bag = open_bag((folder_ / "a.db3").string()).value();
  const Read read = read_all(*bag);
  EXPECT_EQ(read.messages.size(), 2U);
  ASSERT_EQ(read.errors.size(), 1U);
  EXPECT_NE(read.errors[0].find("a.db3: /b: message at 2: zstd"), std::string::npos) << read.errors[0];
}

TEST_F(BagFolders, OtherDatabasesAreRefused) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open((folder_ / "other.db3").c_str(), &db), SQLITE_OK);
  sqlite3_exec(db, "CREATE TABLE topics(id); CREATE VIEW messages AS SELECT 1", nullptr, nullptr, nullptr);
  sqlite3_close(db);
  const auto bag = open_bag((folder_ / "other.db3").string());
  ASSERT_FALSE(bag);
  EXPECT_NE(bag.error().message.find("expected rosbag2's tables"), std::string::npos) << bag.error().message;
}

/// One that nobody writes to was waited for without end.
TEST_F(BagFolders, PipesAreNotRead) {
  const fs::path pipe = folder_ / "pipe.mcap";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(open_bag(pipe.string()).error().message, pipe.string() + ": is a pipe, expected a file");
  write_bytes(folder_ / "bag.mcap", mcap_of(samples()));
  write_bytes(folder_ / "metadata.yaml", metadata_of({"pipe.mcap", "bag.mcap"}, 23));
  auto bag = open_bag(folder_.string());
  ASSERT_TRUE(bag) << bag.error().message;
  Read read = read_all(**bag);
  EXPECT_EQ(read.messages.size(), 23U);
  EXPECT_EQ(read.errors, (std::vector<std::string>{pipe.string() + ": is a pipe, expected a file"}));
  fs::remove(folder_ / "metadata.yaml");
  fs::rename(pipe, folder_ / "metadata.yaml");
  bag = open_bag(folder_.string());
  ASSERT_TRUE(bag) << bag.error().message;
  read = read_all(**bag);
  EXPECT_EQ(read.messages.size(), 23U);
  EXPECT_TRUE(read.notes.at(0).starts_with((folder_ / "metadata.yaml").string() + ": is a pipe, expected a file"));
}

TEST_F(BagFolders, AFileDoesNotUnpackToAThousandTimesItsSize) {
  const std::string path = (folder_ / "zeros.mcap.zstd").string();
  write_bytes(path, packed(kMagic + std::string(10'000'000, '\0'), "zstd"));
  const auto refused = internal::PackedFile::unpack(path, 1'000'000);
  ASSERT_FALSE(refused);
  EXPECT_TRUE(refused.error().message.ends_with(" bytes unpack to more than 1000000")) << refused.error().message;
  EXPECT_TRUE(internal::PackedFile::unpack(path));
}

TEST(Rosbag2Metadata, FilesStayInTheirFolder) {
  const auto metadata = parse_rosbag2_metadata(metadata_of({"bag/bag_0.db3", "../../etc/passwd"}, 9), "m").value();
  EXPECT_EQ(metadata.files, (std::vector<std::string>{"bag_0.db3", "passwd"}));
  EXPECT_EQ(metadata.messages, 9U);
  EXPECT_FALSE(parse_rosbag2_metadata("a: 1", "m"));
  EXPECT_FALSE(parse_rosbag2_metadata("rosbag2_bagfile_information: {relative_file_paths: [..]}", "m"));
}

/// One bag in both storages, written by an independent library.
TEST(BagFiles, ABagOfAllTypesIsReadAlikeFromBothStorages) {
  TUTTI_REQUIRE_SHARED("data/bags/all_types");
  std::vector<std::string> of_storage[2];
  for (int i = 0; i < 2; ++i) {
    const auto folder =
        ::tutti::test::shared_path("data/bags/all_types") / (i == 0 ? "test_bag_mcap" : "test_bag_sqlite3");
    auto bag = open_bag(folder.string());
    ASSERT_TRUE(bag) << bag.error().message;
    EXPECT_EQ((*bag)->stated_messages(), 188U);
    for (auto message = (*bag)->next(); message && *message; message = (*bag)->next())  // they differ in their stamps
      of_storage[i].push_back(
          fmt::format("{} {} {}", (*message)->channel->topic, (*message)->channel->type, (*message)->data.size()));
    EXPECT_EQ(of_storage[i].size(), 188U);
    EXPECT_TRUE((*bag)->notes().empty());
    std::ranges::sort(of_storage[i]);
  }
  EXPECT_EQ(of_storage[0], of_storage[1]);
}

TEST(BagFiles, RealSqliteBagsHaveTheCountsOfTheirSources) {
  TUTTI_REQUIRE_SHARED("data/mcap/rosbag2");
  for (const auto& [file, count] : {std::pair{"talker.db3", 20U}, std::pair{"wbag_0.db3", 1246U}}) {
    auto bag = open_bag(::tutti::test::shared_path(std::string("data/mcap/rosbag2/") + file).string());
    ASSERT_TRUE(bag) << bag.error().message;
    const Read read = read_all(**bag);
    EXPECT_EQ(read.messages.size(), count);
    EXPECT_TRUE(read.errors.empty());
  }
}

}  // namespace bag_files_test
}  // namespace tutti::bags
