// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/mcap_writer.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <map>
#include <sstream>

#include "support/bags/bag_writer.hpp"
#include "tutti/bags/internal/chunk.hpp"
#include "tutti/bags/internal/cursor.hpp"
#include "tutti/bags/internal/mcap_format.hpp"
#include "tutti/bags/mcap_reader.hpp"
#include "tutti/base/random.hpp"

namespace tutti::bags {
namespace mcap_writer_test {

struct Entry {
  std::uint16_t channel = 0;
  std::int64_t ns = 0;
  std::string data;
  friend bool operator==(const Entry&, const Entry&) = default;
};

McapTopic topic(const std::string& name, const std::string& type = "pkg/msg/Type") {
  return {.topic = name, .type = type, .schema = "int8 a\n", .schema_encoding = "ros2msg", .message_encoding = "cdr"};
}

/// With channels 1 and 2, from the stream whose buffer outlives the writer.
std::string written(const std::vector<Entry>& entries, const McapWriterOptions& options, bool close = true) {
  std::stringbuf buffer;
  auto writer = McapWriter::create(std::make_unique<std::ostream>(&buffer), "bag", options).value();
  writer.add(topic("/a"));
  writer.add(topic("/b"));
  for (const Entry& entry : entries) EXPECT_TRUE(writer.write(entry.channel, Timestamp{entry.ns}, entry.data));
  if (close) {
    EXPECT_TRUE(writer.close());
  }
  return buffer.str();
}

Result<McapReader> reader_of(std::string bytes) {
  return McapReader::open(std::make_unique<std::istringstream>(std::move(bytes)), "bag");
}
std::vector<Entry> read_all(McapReader& reader) {
  std::vector<Entry> out;
  for (auto message = reader.next(); message && *message; message = reader.next())
    out.push_back({static_cast<std::uint16_t>((*message)->channel->topic == "/a" ? 1 : 2), (*message)->log_time.ns,
                   std::string((*message)->data)});
  return out;
}

RC_GTEST_PROP(McapWriter, WhatIsWrittenIsRead, ()) {
  const McapWriterOptions options{.zstd = *rc::gen::arbitrary<bool>(),
                                  .chunk_bytes = *rc::gen::element<std::size_t>(1, 100, 100'000)};
  const auto entries = *rc::gen::container<std::vector<Entry>>(
      rc::gen::construct<Entry>(rc::gen::inRange<std::uint16_t>(1, 3), rc::gen::inRange<std::int64_t>(0, 1'000'000),
                                rc::gen::string<std::string>()));
  auto reader = reader_of(written(entries, options)).value();
  RC_ASSERT(reader.summary().has_value());
  RC_ASSERT(reader.summary()->messages == entries.size());
  RC_ASSERT(reader.summary()->chunks == reader.summary()->chunk_indexes);
  RC_ASSERT(reader.channels().size() == 2U);  // by the summary
  RC_ASSERT(read_all(reader) == entries);
  RC_ASSERT(reader.notes().empty());
}

TEST(McapWriter, WhatWasNotClosedIsReadUpToItsLastChunk) {
  std::vector<Entry> entries;
  for (std::int64_t i = 0; i < 10; ++i) entries.push_back({1, i, std::string(40, 'x')});
  auto reader = reader_of(written(entries, {.chunk_bytes = 300}, false)).value();
  EXPECT_FALSE(reader.summary());
  EXPECT_EQ(read_all(reader).size(), 8U);  // two chunks; the first has the schema and the channels, too
}

/// Every index entry leads to the message that it names; every CRC is that of the bytes it is of.
TEST(McapWriter, IndexAndChecksumsAreOfWhatIsThere) {
  const std::vector<Entry> entries{{1, 30, "first"}, {2, 10, "second"}, {1, 20, "third"}};
  const std::string bytes = written(entries, {.zstd = false, .chunk_bytes = 1'000});
  using internal::Cursor;
  std::map<std::uint16_t, std::vector<std::string>> indexed;
  std::string_view records;
  for (Cursor file(std::string_view(bytes).substr(8)); file.left() > 8;) {
    const std::size_t at = file.at();
    const auto opcode = file.number<std::uint8_t>("opcode");
    Cursor record(file.take(file.number<std::uint64_t>("length"), "content"));
    ASSERT_TRUE(file.ok()) << *file.error();
    if (opcode == internal::kChunk) {
      EXPECT_EQ(record.number<std::uint64_t>("first"), 10U);
      EXPECT_EQ(record.number<std::uint64_t>("last"), 30U);
      const auto size = record.number<std::uint64_t>("size");
      const auto crc = record.number<std::uint32_t>("crc");
      record.counted("compression");
      records = record.take(record.number<std::uint64_t>("packed"), "records");
      EXPECT_EQ(records.size(), size);
      EXPECT_EQ(internal::crc32(records), crc);
    } else if (opcode == internal::kMessageIndex) {
      const auto channel = record.number<std::uint16_t>("channel");
      for (Cursor list(record.counted("entries")); list.left() > 0;) {
        const auto ns = list.number<std::uint64_t>("stamp");
        Cursor message(records.substr(list.number<std::uint64_t>("offset")));
        EXPECT_EQ(message.number<std::uint8_t>("opcode"), internal::kMessage);
        Cursor content(message.take(message.number<std::uint64_t>("length"), "message"));
        EXPECT_EQ(content.number<std::uint16_t>("channel"), channel);
        content.number<std::uint32_t>("sequence");
        EXPECT_EQ(content.number<std::uint64_t>("log_time"), ns);
        content.number<std::uint64_t>("publish_time");
        indexed[channel].emplace_back(content.take(content.left(), "data"));
      }
    } else if (opcode == internal::kDataEnd) {
      EXPECT_EQ(record.number<std::uint32_t>("crc"), internal::crc32(std::string_view(bytes).substr(0, 8 + at)));
    } else if (opcode == internal::kFooter) {
      const auto begin = record.number<std::uint64_t>("summary_start");
      record.number<std::uint64_t>("summary_offset_start");
      const std::string_view summary = std::string_view(bytes).substr(begin, bytes.size() - 8 - 4 - begin);
      EXPECT_EQ(record.number<std::uint32_t>("crc"), internal::crc32(summary));
    }
  }
  EXPECT_EQ(indexed, (std::map<std::uint16_t, std::vector<std::string>>{{1, {"first", "third"}}, {2, {"second"}}}));
}

TEST(McapWriter, StampsBefore1970AndFullDisksAreErrors) {
  std::stringbuf buffer;
  auto writer = McapWriter::create(std::make_unique<std::ostream>(&buffer), "bag").value();
  const auto channel = writer.add(topic("/a"));
  EXPECT_EQ(writer.write(channel, Timestamp{-1}, "").error().message,
            "bag: message 0 has stamp -1 ns, expected 0 or more");
  EXPECT_EQ(McapWriter::create("/no/such/folder/bag").error().code, ErrorCode::io);
  auto full = McapWriter::create("/dev/full", {.chunk_bytes = 1});
  ASSERT_TRUE(full);  // its head is still buffered
  const auto id = full->add(topic("/a"));
  Rng rng(1);
  std::string noise(1 << 20, ' ');  // what does not become small
  for (char& c : noise) c = static_cast<char>(rng.index(256));
  const Status written = full->write(id, Timestamp{1}, noise);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::io);
}

}  // namespace mcap_writer_test
}  // namespace tutti::bags
