// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/mcap_writer.hpp"

#include <algorithm>
#include <fstream>
#include <limits>

#include "tutti/bags/internal/byte_writer.hpp"
#include "tutti/bags/internal/chunk.hpp"
#include "tutti/bags/internal/mcap_format.hpp"
#include "tutti/base/check.hpp"

namespace tutti::bags {
namespace {

using internal::ByteWriter;

std::string record(internal::Opcode opcode, std::string_view content) {
  return ByteWriter().number<std::uint8_t>(opcode).number<std::uint64_t>(content.size()).raw(content).take();
}

template <class Map, class Put>
void put_map(ByteWriter& out, const Map& map, const Put& put) {
  ByteWriter inside;
  for (const auto& [key, value] : map) put(inside, key, value);
  out.counted(inside.bytes());
}

}  // namespace

void McapWriter::Span::take(std::uint64_t ns, bool is_first) {
  first = is_first ? ns : std::min(first, ns);
  last = is_first ? ns : std::max(last, ns);
}

Result<McapWriter> McapWriter::create(const std::string& path, const McapWriterOptions& options) {
  auto file = std::make_unique<std::ofstream>(path, std::ios::binary | std::ios::trunc);
  if (!*file) return fail(ErrorCode::io, "{}: cannot be written", path);
  return create(std::move(file), path, options);
}

Result<McapWriter> McapWriter::create(std::unique_ptr<std::ostream> stream, std::string name,
                                      const McapWriterOptions& options) {
  McapWriter writer(std::move(stream), std::move(name), options);
  const std::string header = ByteWriter().counted(options.profile).counted("tutti").take();
  if (auto ok = writer.put(std::string(internal::kMagic) + record(internal::kHeader, header)); !ok)
    return tl::unexpected(ok.error());
  return writer;
}

Status McapWriter::put(std::string_view bytes) {
  stream_->write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!*stream_) return fail(ErrorCode::io, "{}: byte {}: {} bytes cannot be written", name_, written_, bytes.size());
  crc_ = internal::crc32(bytes, crc_);
  written_ += bytes.size();
  return {};
}

std::uint16_t McapWriter::add(const McapTopic& topic) {
  TUTTI_CHECK(channels_.size() < std::numeric_limits<std::uint16_t>::max());
  const auto next_schema = static_cast<std::uint16_t>(schemas_.size() + 1);
  const auto [schema, is_new] = schema_ids_.try_emplace(topic.type, next_schema);
  if (is_new) {
    ByteWriter out;
    out.number(schema->second).counted(topic.type).counted(topic.schema_encoding).counted(topic.schema);
    schemas_.push_back(record(internal::kSchema, out.bytes()));
    chunk_ += schemas_.back();
  }
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  ByteWriter out;
  out.number(id).number(schema->second).counted(topic.topic).counted(topic.message_encoding);
  put_map(out, topic.metadata, [](ByteWriter& inside, const std::string& key, const std::string& value) {
    inside.counted(key).counted(value);
  });
  channels_.push_back(record(internal::kChannel, out.bytes()));
  chunk_ += channels_.back();
  counts_.push_back(0);
  return id;
}

Status McapWriter::write(std::uint16_t channel, Timestamp stamp, std::string_view data) {
  TUTTI_CHECK(channel >= 1 && channel <= channels_.size(), "channel {} of {}", channel, channels_.size());
  if (stamp.ns < 0)
    return fail(ErrorCode::invalid, "{}: message {} has stamp {} ns, expected 0 or more", name_, messages_, stamp.ns);
  const auto ns = static_cast<std::uint64_t>(stamp.ns);
  const auto sequence = static_cast<std::uint32_t>(counts_[channel - 1]++);
  index_[channel].emplace_back(ns, chunk_.size());
  ByteWriter head;
  head.number<std::uint8_t>(internal::kMessage).number<std::uint64_t>(2 + 4 + 8 + 8 + data.size());
  head.number(channel).number(sequence).number(ns).number(ns);
  chunk_.append(head.bytes()).append(data);
  span_.take(ns, messages_++ == 0);
  chunk_span_.take(ns, index_.size() == 1 && index_.begin()->second.size() == 1);
  return chunk_.size() < options_.chunk_bytes ? Status{} : put_chunk();
}

Status McapWriter::put_chunk() {
  if (chunk_.empty()) return {};
  const std::string packed = options_.zstd ? internal::pack_zstd(chunk_) : std::string();
  const std::string_view inside = options_.zstd ? std::string_view(packed) : std::string_view(chunk_);
  ByteWriter head;
  head.number(chunk_span_.first).number(chunk_span_.last).number<std::uint64_t>(chunk_.size());
  head.number(internal::crc32(chunk_)).counted(options_.zstd ? "zstd" : "").number<std::uint64_t>(inside.size());
  ChunkIndex entry{.span = chunk_span_, .offset = written_, .packed_size = inside.size(), .size = chunk_.size()};
  ByteWriter begin;
  begin.number<std::uint8_t>(internal::kChunk).number<std::uint64_t>(head.size() + inside.size()).raw(head.bytes());
  if (auto ok = put(begin.bytes()); !ok) return ok;
  if (auto ok = put(inside); !ok) return ok;
  entry.length = written_ - entry.offset;
  for (const auto& [channel, messages] : index_) {
    entry.index_offsets[channel] = written_;
    ByteWriter out;
    out.number(channel);
    put_map(out, messages,
            [](ByteWriter& list, std::uint64_t ns, std::uint64_t offset) { list.number(ns).number(offset); });
    if (auto ok = put(record(internal::kMessageIndex, out.bytes())); !ok) return ok;
  }
  entry.index_length = written_ - entry.offset - entry.length;
  chunks_.push_back(std::move(entry));
  chunk_.clear();
  chunk_span_ = {};
  index_.clear();
  return {};
}

std::string McapWriter::statistics() const {
  ByteWriter out;
  out.number(messages_).number(static_cast<std::uint16_t>(schemas_.size()));
  out.number(static_cast<std::uint32_t>(channels_.size())).number<std::uint32_t>(0).number<std::uint32_t>(0);
  out.number(static_cast<std::uint32_t>(chunks_.size())).number(span_.first).number(span_.last);
  std::map<std::uint16_t, std::uint64_t> counts;
  for (std::size_t i = 0; i < counts_.size(); ++i) counts[static_cast<std::uint16_t>(i + 1)] = counts_[i];
  put_map(out, counts,
          [](ByteWriter& inside, std::uint16_t id, std::uint64_t count) { inside.number(id).number(count); });
  return record(internal::kStatistics, out.bytes());
}

/// All between DataEnd and the magic, but for its own CRC. `begin` is where it begins in the file.
std::string McapWriter::summary(std::uint64_t begin) const {
  ByteWriter out, offsets;
  const auto group = [&](internal::Opcode opcode, const auto& put_all) {
    const std::uint64_t start = begin + out.size();
    put_all();
    const std::uint64_t length = begin + out.size() - start;
    if (length == 0) return;
    ByteWriter entry;
    entry.number<std::uint8_t>(opcode).number(start).number(length);
    offsets.raw(record(internal::kSummaryOffset, entry.bytes()));
  };
  group(internal::kSchema, [&] {
    for (const std::string& schema : schemas_) out.raw(schema);
  });
  group(internal::kChannel, [&] {
    for (const std::string& channel : channels_) out.raw(channel);
  });
  group(internal::kStatistics, [&] { out.raw(statistics()); });
  group(internal::kChunkIndex, [&] {
    for (const ChunkIndex& chunk : chunks_) {
      ByteWriter entry;
      entry.number(chunk.span.first).number(chunk.span.last).number(chunk.offset).number(chunk.length);
      put_map(entry, chunk.index_offsets,
              [](ByteWriter& inside, std::uint16_t id, std::uint64_t offset) { inside.number(id).number(offset); });
      entry.number(chunk.index_length).counted(options_.zstd ? "zstd" : "");
      entry.number(chunk.packed_size).number(chunk.size);
      out.raw(record(internal::kChunkIndex, entry.bytes()));
    }
  });
  const std::uint64_t offsets_begin = begin + out.size();
  out.raw(offsets.bytes());
  out.number<std::uint8_t>(internal::kFooter).number(internal::kFooterBytes).number(begin).number(offsets_begin);
  return out.take();
}

Status McapWriter::close() {
  if (auto ok = put_chunk(); !ok) return ok;
  if (auto ok = put(record(internal::kDataEnd, ByteWriter().number(crc_).bytes())); !ok) return ok;
  std::string end = summary(written_);
  end += ByteWriter().number(internal::crc32(end)).raw(internal::kMagic).bytes();
  if (auto ok = put(end); !ok) return ok;
  stream_->flush();
  if (!*stream_) return fail(ErrorCode::io, "{}: its end cannot be written", name_);
  return {};
}

}  // namespace tutti::bags
