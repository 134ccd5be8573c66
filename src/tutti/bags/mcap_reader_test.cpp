// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/mcap_reader.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <sstream>

#include "support/bags/bag_writer.hpp"

namespace tutti::bags {
namespace mcap_reader_test {

using namespace test;

struct Read {
  std::vector<std::string> messages;  ///< "topic stamp data"
  std::vector<std::string> errors, notes;
};

Result<McapReader> reader_of(std::string bytes) {
  return McapReader::open(std::make_unique<std::istringstream>(std::move(bytes)), "bag");
}

Read read_all(McapReader& reader) {
  Read out;
  while (true) {
    const auto message = reader.next();
    if (!message)
      out.errors.push_back(message.error().message);
    else if (!*message)
      break;
    else
      out.messages.push_back(
          fmt::format("{} {} {}", (*message)->channel->topic, (*message)->log_time.ns, (*message)->data));
  }
  out.notes = reader.notes();
  return out;
}
Read read_all(const std::string& bytes) {
  auto reader = reader_of(bytes);
  return reader ? read_all(*reader) : Read{{}, {reader.error().message}, {}};
}

const std::string kDefinitions = schema(1, "pkg/msg/Type") + channel(1, 1, "/a");

std::string messages(std::uint64_t from, std::uint64_t to) {
  std::string out;
  for (std::uint64_t i = from; i < to; ++i) out += message(1, i, "data" + std::to_string(i));
  return out;
}

/// Six messages, in two chunks if it has any.
std::string bag(const std::string& how) {
  const std::string head = kMagic + header();
  if (how == "unchunked") return closed(head + kDefinitions + messages(0, 6), kDefinitions, 6);
  const std::string compression = how == "none" ? "" : how;
  return closed(head + chunk(kDefinitions + messages(0, 3), compression) + chunk(messages(3, 6), compression),
                kDefinitions, 6, 2);
}

class McapFiles : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(EveryStorage, McapFiles, ::testing::Values("unchunked", "none", "zstd", "lz4"));

TEST_P(McapFiles, AreReadInOrder) {
  auto reader = reader_of(bag(GetParam())).value();
  ASSERT_TRUE(reader.summary());
  EXPECT_EQ(reader.summary()->messages, 6U);
  EXPECT_EQ(reader.channels().at(0)->type, "pkg/msg/Type");  // before any message was read
  const Read read = read_all(reader);
  EXPECT_EQ(read.messages, (std::vector<std::string>{"/a 0 data0", "/a 1 data1", "/a 2 data2", "/a 3 data3",
                                                     "/a 4 data4", "/a 5 data5"}));
  EXPECT_TRUE(read.errors.empty());
  EXPECT_TRUE(read.notes.empty());
}

TEST_P(McapFiles, CutAnywhereKeepWhatIsBeforeTheCut) {
  const std::string whole = bag(GetParam());
  const std::vector<std::string> all = read_all(whole).messages;
  std::size_t most = 0;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const Read read = read_all(whole.substr(0, size));
    ASSERT_TRUE(read.messages.size() <= all.size() &&
                std::equal(read.messages.begin(), read.messages.end(), all.begin()));
    ASSERT_GE(read.messages.size(), most) << size;  // a longer file never gives less
    most = read.messages.size();
    // Only the magic at the very end is not missed: everything is there.
    const bool noted = size >= kMagic.size() && size + kMagic.size() < whole.size();
    ASSERT_EQ(read.errors.size(), size < kMagic.size() ? 1U : 0U) << size;
    ASSERT_EQ(read.notes.size(), noted ? 1U : 0U) << size;
  }
  EXPECT_EQ(most, all.size());
}

/// Also where only what stands before them defines what they are.
TEST_P(McapFiles, MessagesAreComeBackTo) {
  const std::string whole = bag(GetParam());
  for (const std::size_t size : {whole.size(), whole.size() - 100}) {
    std::vector<std::pair<BagPosition, std::string>> all;
    auto reader = reader_of(whole.substr(0, size)).value();
    for (auto message = reader.next(); message && *message; message = reader.next())
      all.emplace_back((*message)->position, (*message)->data);
    ASSERT_EQ(all.size(), 6U);
    for (const std::size_t i : {5, 1, 2, 0, 4, 3}) {
      auto other = reader_of(whole.substr(0, size)).value();
      for (McapReader* const one : {&reader, &other}) {
        ASSERT_TRUE(one->seek(all[i].first));
        const auto message = one->next();
        ASSERT_TRUE(message && *message) << message.error().message;
        EXPECT_EQ((*message)->data, all[i].second);
        EXPECT_EQ((*message)->channel->topic, "/a");
      }
    }
  }
}

TEST(Mcap, CutNamesByteAndRecord) {
  const std::string head = kMagic + header() + kDefinitions;
  const Read read = read_all(head + message(1, 4, "data").substr(0, 20));
  EXPECT_EQ(read.notes, (std::vector<std::string>{fmt::format(
                            "bag: byte {}: cut off: record Message wants 26 bytes, 11 are left", head.size())}));
}

RC_GTEST_PROP(Mcap, FlippedBytesNeverCrash, ()) {
  std::string bytes = bag(*rc::gen::element<std::string>("unchunked", "none", "zstd", "lz4"));
  const auto at = *rc::gen::inRange<std::size_t>(0, bytes.size());
  bytes[at] = static_cast<char>(bytes[at] ^ *rc::gen::inRange(1, 256));
  RC_ASSERT(read_all(bytes).messages.size() <= 6U);
}

TEST(Mcap, AChunkThatHasChangedIsLostAlone) {
  for (const std::string compression : {"", "zstd", "lz4"}) {
    const std::string first = kMagic + header() + kDefinitions;
    const std::string bad = chunk(messages(0, 3), compression, messages(0, 3).size(), 1);
    const Read read = read_all(closed(first + bad + chunk(messages(3, 6), compression), kDefinitions, 6, 2));
    EXPECT_EQ(read.messages.size(), 3U);
    ASSERT_EQ(read.errors.size(), 1U);
    EXPECT_NE(read.errors[0].find(fmt::format("bag: byte {}: record Chunk: CRC ", first.size())), std::string::npos)
        << read.errors[0];
  }
}

/// Chunks have several blocks of both compressions, which refer to what is before them.
TEST(Mcap, LongChunksAreReadAndCutOnesInPart) {
  constexpr std::uint64_t kCount = 20'000;
  const std::string first = kMagic + header(), records = kDefinitions + messages(0, kCount);
  ASSERT_GT(records.size(), std::size_t{500'000});
  for (const std::string compression : {"", "zstd", "lz4"}) {
    const std::string whole = first + chunk(records, compression);
    EXPECT_EQ(read_all(closed(whole, kDefinitions, kCount, 1)).messages.size(), kCount) << compression;
    const Read half = read_all(whole.substr(0, whole.size() / 2));
    EXPECT_TRUE(half.errors.empty()) << compression << half.errors[0];
    EXPECT_GT(half.messages.size(), kCount / 10) << compression;
    EXPECT_LT(half.messages.size(), kCount) << compression;
    EXPECT_EQ(half.messages.back(), fmt::format("/a {0} data{0}", half.messages.size() - 1)) << compression;
  }
}

TEST(Mcap, SizesOfChunksThatLieAreRefused) {
  const std::string records = messages(0, 3), first = kMagic + header() + kDefinitions;
  for (const std::string compression : {"", "zstd", "lz4"})
    for (const std::uint64_t size : {std::uint64_t{0}, std::uint64_t{1}, records.size() - 1, records.size() + 1,
                                     std::uint64_t{1} << 30, std::uint64_t{1} << 63}) {
      const Read read = read_all(closed(first + chunk(records, compression, size, 0), kDefinitions, 6, 1));
      EXPECT_EQ(read.errors.size(), 1U) << compression << " " << size;
      EXPECT_TRUE(read.messages.empty()) << compression << " " << size;
    }
}

TEST(Mcap, WhatIsWrongIsNamed) {
  const std::string first = kMagic + header() + kDefinitions;
  const auto error_of = [&](const std::string& record) {
    const Read read = read_all(closed(first + record + messages(0, 1), "", 1));
    EXPECT_EQ(read.messages.size(), 1U);  // what comes behind it is read
    return read.errors.size() == 1 ? read.errors[0] : fmt::format("{} errors", read.errors.size());
  };
  const std::string at = fmt::format("bag: byte {}: record ", first.size());
  EXPECT_EQ(error_of(message(9, 1, "")), at + "Message: channel 9, expected one that is defined before");
  EXPECT_EQ(error_of(record(5, "abc")), at + "Message: byte 2: sequence wants 4 bytes, 1 are left");
  EXPECT_EQ(error_of(channel(2, 9, "/b")),
            at + "Channel: channel 2 ('/b') has schema 9, expected one that is defined before");
  EXPECT_EQ(error_of(channel(1, 1, "/b")), at + "Channel: channel 1 is '/b', expected '/a' as before");
  EXPECT_EQ(error_of(schema(1, "other")), at + "Schema: schema 1 is 'other', expected 'pkg/msg/Type' as before");
  EXPECT_EQ(error_of(chunk("", "brotli")), at + "Chunk: compression 'brotli', expected none, zstd, lz4 or bz2");
  EXPECT_EQ(error_of(message(1, ~std::uint64_t{0}, "")).substr(0, at.size() + 20), at + "Message: log_time 18");
}

TEST(Mcap, RecordsOfOtherKindsArePassedOver) {
  const std::string bytes = kMagic + header() + record(9, "attachment") + record(200, "private") + kDefinitions +
                            record(12, "metadata") + messages(0, 2);
  EXPECT_EQ(read_all(closed(bytes, kDefinitions, 2)).messages.size(), 2U);
}

TEST(Mcap, ABrokenSummaryIsOnlyNoted) {
  std::string bytes = bag("zstd");
  bytes.replace(bytes.size() - 8 - 20, 8, little(std::uint64_t{1} << 40));
  auto reader = reader_of(bytes).value();
  EXPECT_FALSE(reader.summary());
  const Read read = read_all(reader);
  EXPECT_EQ(read.messages.size(), 6U);
  ASSERT_EQ(read.notes.size(), 1U);
  EXPECT_NE(read.notes[0].find("the summary is not used"), std::string::npos);
}

TEST(Mcap, OtherFilesAreNamed) {
  EXPECT_NE(reader_of("").error().message.find("no MCAP file"), std::string::npos);
  EXPECT_EQ(McapReader::open("/no/such/file").error().code, ErrorCode::io);
}

TEST(Mcap, AChunkIsGivenUpAtItsFirstImpossibleRecord) {
  const std::string first = kMagic + header() + kDefinitions;
  for (const std::string& impossible :
       {std::string(1'000, '\0'), record(5, "abc"), record(5, "").substr(0, 8) + "\1"}) {
    const std::string bad = chunk(messages(0, 2) + impossible + messages(2, 3), "zstd");
    const Read read = read_all(closed(first + bad + chunk(messages(3, 6), "zstd"), kDefinitions, 6, 2));
    EXPECT_EQ(read.messages.size(), 5U);
    ASSERT_EQ(read.errors.size(), 1U);
    EXPECT_NE(read.errors[0].find("in this chunk: "), std::string::npos) << read.errors[0];
  }
}

/// It was 11 million errors.
TEST(Mcap, ChunksOfZerosAreOneErrorEach) {
  const auto error_of = [](std::size_t zeros, const char* compression) {
    const std::string bomb = chunk(std::string(zeros, '\0'), compression, zeros, 0);
    EXPECT_LT(bomb.size(), zeros / 200);
    const Read read = read_all(closed(kMagic + header() + bomb + kDefinitions + messages(0, 1), kDefinitions, 1, 1));
    EXPECT_EQ(read.messages.size(), 1U);
    EXPECT_EQ(read.errors.size(), 1U);
    return read.errors.at(0);
  };
  EXPECT_NE(error_of(100'000'000, "zstd").find("unpack to 100000000, expected at most 67108864"), std::string::npos);
  for (const char* compression : {"zstd", "bz2", "lz4"})
    EXPECT_NE(error_of(5'000'000, compression).find("opcode 0, which no record has; 4999991 bytes behind it are not"),
              std::string::npos);
}

TEST(Mcap, OfACutChunkNoMoreIsUnpackedThanOfAWholeOne) {
  const std::string begin = kDefinitions + messages(0, 1), zeros(70'000'000, '\0');
  const std::string bytes = kMagic + header() + chunk(begin + zeros, "zstd", begin.size() + zeros.size(), 0);
  const Read read = read_all(bytes.substr(0, bytes.size() - 1));
  EXPECT_EQ(read.messages.size(), 1U);
  ASSERT_EQ(read.errors.size(), 1U);
  EXPECT_NE(read.errors[0].find(fmt::format("; {} bytes", 67108864 - begin.size() - 9)), std::string::npos)
      << read.errors[0];
}

TEST(Mcap, ZerosBehindTheLastRecordAreOneError) {
  const Read read = read_all(kMagic + header() + kDefinitions + messages(0, 3) + std::string(1'000'000, '\0'));
  EXPECT_EQ(read.messages.size(), 3U);
  EXPECT_EQ(read.errors.size(), 1U);
}

TEST(Mcap, OfWrongRecordsTheFirstOfEachChannelAndChunkIsAnError) {
  std::string records;
  for (std::uint64_t i = 0; i < 100; ++i)
    records += message(8, i, "") + message(9, i, "") + message(1, ~std::uint64_t{0}, "") + channel(1, 1, "/b") +
               channel(2, 9, "/c") + schema(1, "other") + messages(i, i + 1);
  const Read read = read_all(
      closed(kMagic + header() + kDefinitions + chunk(records, "") + chunk(records, ""), kDefinitions, 200, 2));
  EXPECT_EQ(read.messages.size(), 200U);
  EXPECT_EQ(read.errors.size(), 12U);
}

}  // namespace mcap_reader_test
}  // namespace tutti::bags
