// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/mcap_reader.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "tutti/bags/internal/chunk.hpp"
#include "tutti/bags/internal/cursor.hpp"
#include "tutti/bags/internal/mcap_format.hpp"
#include "tutti/bags/ros_types.hpp"

namespace tutti::bags {
namespace {

using namespace internal;  // Cursor and the format

constexpr std::array kNames{"nothing",  "Header",        "Footer",        "Schema",     "Channel",         "Message",
                            "Chunk",    "MessageIndex",  "ChunkIndex",    "Attachment", "AttachmentIndex", "Statistics",
                            "Metadata", "MetadataIndex", "SummaryOffset", "DataEnd"};

std::string name_of(std::uint8_t opcode) {
  return opcode < kNames.size() ? kNames[opcode] : fmt::format("of unknown kind {}", opcode);
}

/// MCAP's own would go on to the year 2554.
constexpr auto kLastStamp = static_cast<std::uint64_t>(kLastTimestamp.ns);

}  // namespace

template <class... Args>
tl::unexpected<Error> McapReader::fail_at(const Record& record, ErrorCode code, fmt::format_string<Args...> format,
                                          Args&&... args) const {
  return fail(code, "{}: byte {}: record {}{}: {}", file_.name(), record.offset, name_of(record.opcode),
              chunk_.empty() ? "" : " in this chunk", fmt::format(format, std::forward<Args>(args)...));
}

Result<McapReader> McapReader::open(const std::string& path) { return open(internal::FileBytes::open(path)); }

Result<McapReader> McapReader::open(std::unique_ptr<std::istream> stream, std::string name) {
  return open(internal::FileBytes::open(std::move(stream), std::move(name)));
}

Result<McapReader> McapReader::open(Result<internal::FileBytes> file) {
  if (!file) return tl::unexpected(file.error());
  McapReader reader(std::move(*file));
  if (auto ok = reader.start(); !ok) return tl::unexpected(ok.error());
  return reader;
}

Status McapReader::start() {
  std::string magic;
  if (auto ok = file_.read(0, std::min<std::uint64_t>(file_.size(), kMagic.size()), magic); !ok) return ok;
  if (magic != kMagic)
    return fail(ErrorCode::parse, "{}: byte 0: is no MCAP file, expected 89 'MCAP0' 0d 0a", file_.name());
  offset_ = defined_until_ = kMagic.size();
  read_summary_notes();
  all_defined_ = summary_ && channels_.size() >= summary_->channels;
  return {};
}

/// There must be so many bytes as a record's head has.
Result<McapReader::Record> McapReader::record_at(std::uint64_t offset) {
  std::string head;
  if (auto ok = file_.read(offset, kRecordHeadBytes, head); !ok) return tl::unexpected(ok.error());
  Cursor cursor(head);
  Record record{.offset = offset};
  record.opcode = cursor.number<std::uint8_t>("opcode");
  record.size = cursor.number<std::uint64_t>("length");
  return record;
}

void McapReader::end(std::string note) {
  ended_ = true;
  if (!note.empty() && std::ranges::find(notes_, note) == notes_.end()) notes_.push_back(std::move(note));
}

/// Messages do not need the summary: one that is not there, or broken, is only noted.
void McapReader::read_summary_notes() {
  const std::uint64_t tail = kRecordHeadBytes + kFooterBytes + kMagic.size();
  if (file_.size() < kMagic.size() + tail) return;
  std::string magic, footer;
  if (!file_.read(file_.size() - kMagic.size(), kMagic.size(), magic) || magic != kMagic) return;
  const auto record = record_at(file_.size() - tail);
  if (!record || record->opcode != kFooter || record->size != kFooterBytes) return;
  if (!file_.read(record->offset + kRecordHeadBytes, kFooterBytes, footer)) return;
  const auto begin = Cursor(footer).number<std::uint64_t>("summary_start");
  if (begin == 0) return;
  Status ok;
  if (begin < kMagic.size() || begin > record->offset)
    ok = fail_at(*record, ErrorCode::parse, "summary begins at byte {}, expected {} to {}", begin, kMagic.size(),
                 record->offset);
  else
    ok = read_summary(begin, record->offset);
  if (ok) return;
  summary_.reset();
  notes_.push_back(ok.error().message + "; the summary is not used");
}

Status McapReader::read_summary(std::uint64_t begin, std::uint64_t end) {
  McapSummary summary;
  std::string content;
  for (std::uint64_t at = begin; at < end;) {
    const auto record = end - at < kRecordHeadBytes ? Result<Record>(Record{.offset = at}) : record_at(at);
    if (!record) return tl::unexpected(record.error());
    if (end - at < kRecordHeadBytes || record->size > end - at - kRecordHeadBytes)
      return fail_at(*record, ErrorCode::parse, "length {}, expected an end before byte {}", record->size, end);
    at += kRecordHeadBytes + record->size;
    summary.chunk_indexes += record->opcode == kChunkIndex ? 1 : 0;
    if (record->opcode != kSchema && record->opcode != kChannel && record->opcode != kStatistics) continue;
    if (record->size > internal::kMaxChunkBytes)
      return fail_at(*record, ErrorCode::unsupported, "length {}, expected at most {}", record->size,
                     internal::kMaxChunkBytes);
    if (auto ok = file_.read(record->offset + kRecordHeadBytes, record->size, content); !ok) return ok;
    const Status ok = record->opcode == kSchema    ? define_schema(*record, content)
                      : record->opcode == kChannel ? define_channel(*record, content)
                                                   : take_statistics(*record, content);
    if (!ok) return ok;
  }
  if (summary_) summary_->chunk_indexes = summary.chunk_indexes;
  return {};
}

Status McapReader::take_statistics(const Record& record, std::string_view content) {
  Cursor cursor(content);
  McapSummary summary;
  summary.messages = cursor.number<std::uint64_t>("message_count");
  cursor.take(2, "schema_count");
  summary.channels = cursor.number<std::uint32_t>("channel_count");
  cursor.take(4 + 4, "counts of attachments and metadata");
  summary.chunks = cursor.number<std::uint32_t>("chunk_count");
  cursor.take(8 + 8, "first and last time");
  Cursor counts(cursor.counted("channel_message_counts"));
  while (counts.ok() && counts.left() > 0) {
    const auto channel = counts.number<std::uint16_t>("channel");
    summary.messages_of_channel[channel] = counts.number<std::uint64_t>("count");
  }
  if (!cursor.ok()) return fail_at(record, ErrorCode::parse, "{}", *cursor.error());
  if (!counts.ok()) return fail_at(record, ErrorCode::parse, "channel_message_counts: {}", *counts.error());
  summary_ = summary;
  return {};
}

Status McapReader::define_schema(const Record& record, std::string_view content) {
  Cursor cursor(content);
  const auto id = cursor.number<std::uint16_t>("id");
  std::string name(cursor.counted("name"));
  if (cursor.counted("encoding") == "ros1msg") name = type_of_ros2(name);  // a converted bag
  cursor.counted("data");
  if (!cursor.ok()) return fail_at(record, ErrorCode::parse, "{}", *cursor.error());
  if (id == 0) return fail_at(record, ErrorCode::parse, "id 0, expected 1 or more");
  const auto [at, is_new] = schemas_.try_emplace(id, name);
  if (!is_new && at->second != name && is_first_wrong(record, id))
    return fail_at(record, ErrorCode::invalid, "schema {} is '{:.80}', expected '{:.80}' as before", id, name,
                   at->second);
  return {};
}

Status McapReader::define_channel(const Record& record, std::string_view content) {
  Cursor cursor(content);
  const auto id = cursor.number<std::uint16_t>("id");
  const auto schema = cursor.number<std::uint16_t>("schema_id");
  BagChannel channel;
  channel.topic = cursor.counted("topic");
  channel.message_encoding = cursor.counted("message_encoding");
  cursor.counted("metadata");
  if (!cursor.ok()) return fail_at(record, ErrorCode::parse, "{}", *cursor.error());
  if (schema != 0) {
    const auto type = schemas_.find(schema);
    if (type == schemas_.end()) {
      if (!is_first_wrong(record, id)) return {};
      return fail_at(record, ErrorCode::invalid,
                     "channel {} ('{:.80}') has schema {}, expected one that is defined before", id, channel.topic,
                     schema);
    }
    channel.type = type->second;
  }
  const auto [at, is_new] = channels_.try_emplace(id, channel);
  if (!is_new && (at->second.topic != channel.topic || at->second.type != channel.type) && is_first_wrong(record, id))
    return fail_at(record, ErrorCode::invalid, "channel {} is '{:.80}', expected '{:.80}' as before", id, channel.topic,
                   at->second.topic);
  return {};
}

Result<std::optional<BagMessage>> McapReader::to_message(const Record& record, std::string_view content) {
  Cursor cursor(content);
  BagMessage message{.position = {.at = record.offset, .inside = record.inside}};
  const auto id = cursor.number<std::uint16_t>("channel_id");
  cursor.number<std::uint32_t>("sequence");
  const auto logged = cursor.number<std::uint64_t>("log_time"),
             published = cursor.number<std::uint64_t>("publish_time");
  if (!cursor.ok()) return fail_at(record, ErrorCode::parse, "{}", *cursor.error());
  message.log_time = {static_cast<std::int64_t>(logged)};
  message.publish_time = {static_cast<std::int64_t>(published)};
  message.data = cursor.take(cursor.left(), "data");
  const auto channel = channels_.find(id);
  if (channel == channels_.end() || std::max(logged, published) > kLastStamp) {
    if (!is_first_wrong(record, id)) return std::nullopt;
    if (channel == channels_.end())
      return fail_at(record, ErrorCode::invalid, "channel {}, expected one that is defined before", id);
    return fail_at(record, ErrorCode::invalid, "log_time {} ns, publish_time {} ns, expected at most {}", logged,
                   published, kLastStamp);
  }
  message.channel = &channel->second;
  return message;
}

Result<std::optional<BagMessage>> McapReader::take(const Record& record, std::string_view content) {
  Status ok;
  if (record.opcode == kMessage) return to_message(record, content);
  if (record.opcode == kSchema) {
    ok = define_schema(record, content);
  } else if (record.opcode == kChannel) {
    ok = define_channel(record, content);
  } else if (record.opcode == 0) {
    ok = fail_at(record, ErrorCode::parse, "opcode 0, which no record has");
  }
  if (!ok) return tl::unexpected(ok.error());
  return std::nullopt;
}

/// The record, as far as the file has it, is in record_.
Status McapReader::enter_chunk(const Record& record, bool cut) {
  Cursor cursor(record_);
  cursor.take(8 + 8, "first and last time");
  const auto size = cursor.number<std::uint64_t>("uncompressed_size");
  const auto crc = cursor.number<std::uint32_t>("uncompressed_crc");
  const std::string_view compression = cursor.counted("compression");
  const auto packed_size = cursor.number<std::uint64_t>("length of the records");
  const std::string_view packed = cursor.take(cut ? cursor.left() : packed_size, "records");
  if (!cursor.ok()) return cut ? Status{} : fail_at(record, ErrorCode::parse, "{}", *cursor.error());
  auto chunk = internal::unpack_chunk(packed, compression, size, cut, std::exchange(chunk_, {}));
  if (!chunk) return fail_at(record, chunk.error().code, "{}", chunk.error().message);
  if (const auto found = internal::crc32(*chunk); !cut && crc != 0 && found != crc)
    return fail_at(record, ErrorCode::parse, "CRC {:08x}, expected {:08x}: its bytes have changed", found, crc);
  chunk_ = std::move(*chunk);
  chunk_at_ = 0;
  chunk_offset_ = record.offset;
  chunk_cut_ = cut;
  complained_of_.clear();
  ++chunks_read_;
  return {};
}

Result<std::optional<BagMessage>> McapReader::next() {
  while (true) {
    auto message = chunk_.empty() ? next_of_file() : next_of_chunk();
    if (!message || *message || (ended_ && chunk_.empty())) return message;
  }
}

/// The schemas and channels of the chunk, wherever in it reading goes on.
void McapReader::define_in_chunk() {
  Cursor cursor(chunk_);
  while (cursor.ok() && cursor.left() > 0) {
    Record record{.offset = chunk_offset_, .inside = cursor.at()};
    record.opcode = cursor.number<std::uint8_t>("opcode");
    record.size = cursor.number<std::uint64_t>("length");
    const std::string_view content = cursor.take(record.size, "content");
    if (cursor.ok() && (record.opcode == kSchema || record.opcode == kChannel))
      static_cast<void>(take(record, content));
  }
}

/// Records before a byte that is jumped to may define its channel: of a file without a summary they are read once.
void McapReader::define_until(std::uint64_t offset) {
  offset_ = defined_until_;
  while (offset_ < offset && !ended_) {
    static_cast<void>(next_of_file());
    define_in_chunk();
    chunk_.clear();
  }
  defined_until_ = std::max(defined_until_, offset);
}

Status McapReader::seek(const BagPosition& position) {
  if (chunk_.empty() || chunk_offset_ != position.at) {
    chunk_.clear();
    ended_ = false;
    if (!all_defined_) define_until(position.at);
    ended_ = false;
    offset_ = position.at;
    const auto record = record_at(offset_);
    if (!record) return tl::unexpected(record.error());
    if (record->opcode != kChunk) return {};
    if (const auto entered = next_of_file(); !entered) return tl::unexpected(entered.error());
    if (!all_defined_) {
      define_in_chunk();
      defined_until_ = std::max(defined_until_, offset_);
    }
  }
  if (position.inside > chunk_.size())
    return fail(ErrorCode::parse, "{}: byte {}: chunk of {} bytes, expected more than {}: has the file changed?",
                file_.name(), position.at, chunk_.size(), position.inside);
  chunk_at_ = position.inside;
  return {};
}

std::vector<const BagChannel*> McapReader::channels() const {
  std::vector<const BagChannel*> out;
  for (const auto& [id, channel] : channels_) out.push_back(&channel);
  return out;
}

/// Nothing if the record was none of a message; then the chunk may have come to its end.
Result<std::optional<BagMessage>> McapReader::next_of_chunk() {
  const std::size_t left = chunk_.size() - chunk_at_;
  Cursor cursor(std::string_view(chunk_).substr(chunk_at_));
  Record record{.offset = chunk_offset_, .inside = chunk_at_};
  record.opcode = left > 0 ? cursor.number<std::uint8_t>("opcode") : std::uint8_t{0};
  record.size = left > 0 ? cursor.number<std::uint64_t>("length") : 0;
  if (left == 0 || !cursor.ok() || record.size > cursor.left()) {
    Result<std::optional<BagMessage>> out = std::nullopt;
    if (left > 0 && !chunk_cut_)
      out = fail_at(record, ErrorCode::parse, "at byte {} of its {}: wants {} bytes, {} are left", chunk_at_,
                    chunk_.size(), record.size, cursor.left());
    chunk_.clear();
    return out;
  }
  chunk_at_ += kRecordHeadBytes + record.size;
  auto out = take(record, cursor.take(record.size, "content"));
  if (!out && out.error().code == ErrorCode::parse) {
    out.error().message += fmt::format("; {} bytes behind it are not read", chunk_.size() - chunk_at_);
    chunk_.clear();
  }
  return out;
}

Result<std::optional<BagMessage>> McapReader::next_of_file() {
  const std::uint64_t left = file_.size() - offset_;
  if (ended_) return std::nullopt;
  if (left < kRecordHeadBytes) {
    end(fmt::format("{}: byte {}: ends without a footer: cut off, or never closed", file_.name(), file_.size()));
    return std::nullopt;
  }
  auto record = record_at(offset_);
  if (!record) {
    end("");
    return tl::unexpected(record.error());
  }
  const std::uint64_t begin = offset_ + kRecordHeadBytes, there = left - kRecordHeadBytes;
  const bool cut = record->size > there;
  if (cut) {
    end(fmt::format("{}: byte {}: cut off: record {} wants {} bytes, {} are left", file_.name(), offset_,
                    name_of(record->opcode), record->size, there));
    record->size = there;
  } else {
    offset_ = begin + record->size;
    if (record->opcode == kFooter) end("");
  }
  const bool wanted = record->opcode == kChunk || (!cut && (record->opcode == kSchema || record->opcode == kChannel ||
                                                            record->opcode == kMessage || record->opcode == 0));
  if (!wanted) return std::nullopt;
  if (const auto most = record->opcode == kChunk ? internal::kMaxChunkBytes : internal::kMaxMessageBytes;
      record->size > most)
    return fail_at(*record, ErrorCode::unsupported, "length {}, expected at most {}", record->size, most);
  if (record->opcode == 0) end("");  // zeros, as a file has them at its end after a power cut
  if (auto ok = file_.read(begin, record->size, record_); !ok) {
    end("");
    return tl::unexpected(ok.error());
  }
  if (record->opcode != kChunk) return take(*record, record_);
  if (auto ok = enter_chunk(*record, cut); !ok) return tl::unexpected(ok.error());
  record_.clear();
  record_.shrink_to_fit();  // the packed chunk is not kept beside the unpacked one
  return std::nullopt;
}

}  // namespace tutti::bags
