// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros1_reader.hpp"

#include <algorithm>
#include <array>

#include "tutti/bags/internal/chunk.hpp"
#include "tutti/bags/internal/cursor.hpp"
#include "tutti/bags/ros_types.hpp"

namespace tutti::bags {
namespace {

using internal::Cursor;

constexpr std::string_view kRos1Begin = "#ROSBAG V2.0\n";
constexpr std::uint64_t kMaxHeaderBytes = 1 << 20;

/// Calls `take(name, value)` for each field of a header; reports what is wrong.
template <class Take>
std::optional<std::string> for_fields(std::string_view header, const Take& take) {
  Cursor cursor(header);
  while (cursor.left() > 0) {
    const std::string_view field = cursor.counted("field");
    if (!cursor.ok()) return cursor.error();
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos) return fmt::format("field '{:.40}' has no '='", field);
    take(field.substr(0, equals), field.substr(equals + 1));
  }
  return std::nullopt;
}

}  // namespace

std::string Ros1Reader::name_of(Op op) {
  constexpr std::array kNames{"message", "bag header", "index", "chunk", "chunk info", "connection"};
  return op >= Op::message && op <= Op::connection ? kNames[static_cast<std::size_t>(op) - 2]
                                                   : fmt::format("of unknown kind {}", static_cast<int>(op));
}

template <class... Args>
tl::unexpected<Error> Ros1Reader::fail_at(const BagPosition& position, ErrorCode code,
                                          fmt::format_string<Args...> format, Args&&... args) const {
  return fail(code, "{}: byte {}: {}{}", file_.name(), position.at,
              chunk_.empty() ? "" : fmt::format("at byte {} of the chunk: ", position.inside),
              fmt::format(format, std::forward<Args>(args)...));
}

Result<Ros1Reader> Ros1Reader::open(const std::string& path) { return open(internal::FileBytes::open(path)); }

Result<Ros1Reader> Ros1Reader::open(std::unique_ptr<std::istream> stream, std::string name) {
  return open(internal::FileBytes::open(std::move(stream), std::move(name)));
}

Result<Ros1Reader> Ros1Reader::open(Result<internal::FileBytes> file) {
  if (!file) return tl::unexpected(file.error());
  Ros1Reader reader(std::move(*file));
  if (auto ok = reader.start(); !ok) return tl::unexpected(ok.error());
  return reader;
}

Status Ros1Reader::start() {
  std::string magic;
  if (auto ok = file_.read(0, std::min<std::uint64_t>(file_.size(), kRos1Begin.size()), magic); !ok) return ok;
  if (magic != kRos1Begin)
    return fail(ErrorCode::parse, "{}: byte 0: is no ROS 1 bag, expected '#ROSBAG V2.0'", file_.name());
  offset_ = kRos1Begin.size();
  const auto header = next_record();
  if (header && *header && (*header)->op == Op::bag_header && (*header)->index_at > offset_ &&
      (*header)->index_at < file_.size())
    read_index((*header)->index_at, (*header)->chunks);
  else
    notes_.push_back(fmt::format("{}: has no index: cut off, or never closed", file_.name()));
  ended_ = cut_ = false;
  offset_ = kRos1Begin.size();
  return {};
}

/// Messages do not need the index: of one that is broken what is good is taken.
void Ros1Reader::read_index(std::uint64_t at, std::uint32_t chunks) {
  std::uint64_t messages = 0, infos = 0;
  offset_ = at;
  Result<std::optional<Record>> record;
  for (record = next_record(); record && *record && !cut_; record = next_record()) {
    if ((*record)->op == Op::connection && !define(**record, data_)) break;
    if ((*record)->op != Op::chunk_info) continue;
    ++infos;
    for (Cursor counts(data_); counts.left() > 0 && counts.ok();) {
      counts.number<std::uint32_t>("connection");
      messages += counts.number<std::uint32_t>("count");
    }
  }
  all_defined_ = record && !*record && !cut_ && infos == chunks;
  if (all_defined_) stated_messages_ = messages;
  if (!all_defined_) notes_.push_back(fmt::format("{}: byte {}: its index is broken and not used", file_.name(), at));
}

void Ros1Reader::end(std::string note) {
  ended_ = true;
  if (!note.empty() && std::ranges::find(notes_, note) == notes_.end()) notes_.push_back(std::move(note));
}

Result<Ros1Reader::Record> Ros1Reader::parse_header(std::string_view header, const BagPosition& position) const {
  Record record{.position = position};
  std::optional<std::string> wrong;
  const auto number = [&](std::string_view name, std::string_view value, auto& out) {
    Cursor cursor(value);
    out = cursor.number<std::remove_reference_t<decltype(out)>>(name);
    if (cursor.ok() && cursor.left() > 0) cursor.complain("more bytes than a number has");
    if (!cursor.ok()) wrong = fmt::format("{}: {}", name, *cursor.error());
  };
  const auto unread = for_fields(header, [&](std::string_view name, std::string_view value) {
    if (name == "op") {
      std::uint8_t op = 0;
      number(name, value, op);
      record.op = static_cast<Op>(op);
    }
    if (name == "conn") number(name, value, record.connection);
    if (name == "size") number(name, value, record.size);
    if (name == "chunk_count") number(name, value, record.chunks);
    if (name == "index_pos") number(name, value, record.index_at);
    if (name == "topic") record.topic = value;
    if (name == "compression") record.compression = value;
    std::uint64_t time = 0;  // seconds, then nanoseconds
    if (name == "time") number(name, value, time);
    if (time != 0) record.time.ns = static_cast<std::int64_t>((time & 0xffff'ffffU) * 1'000'000'000U + (time >> 32U));
  });
  if (unread) wrong = unread;
  if (!wrong && record.op == Op{}) wrong = "no op, which every record has";
  if (wrong) return fail_at(position, ErrorCode::parse, "header of a record: {}", *wrong);
  return record;
}

/// The file's next record; its data is in data_ unless nobody wants it. Nothing at the end. When the file ends within a
/// record, cut_ is set and a note reports it.
Result<std::optional<Ros1Reader::Record>> Ros1Reader::next_record() {
  const BagPosition position{.at = offset_};
  const auto cut_off = [&](std::string_view what, std::uint64_t wants, std::uint64_t left) {
    cut_ = true;
    end(fmt::format("{}: byte {}: cut off: {} wants {} bytes, {} are left", file_.name(), position.at, what, wants,
                    left));
  };
  std::string length, header;
  const auto counted = [&](std::string_view what, std::uint64_t& out) -> Result<bool> {
    if (file_.size() - offset_ < 4) {
      cut_off(what, 4, file_.size() - offset_);
      return false;
    }
    if (auto ok = file_.read(offset_, 4, length); !ok) return tl::unexpected(ok.error());
    offset_ += 4;
    out = Cursor(length).number<std::uint32_t>(what);
    return true;
  };
  if (offset_ == file_.size()) {
    end("");
    return std::nullopt;
  }
  std::uint64_t header_size = 0;
  const auto has_header = counted("length of a header", header_size);
  if (!has_header || !*has_header)
    return has_header ? Result<std::optional<Record>>(std::nullopt) : tl::unexpected(has_header.error());
  if (header_size > file_.size() - offset_) {
    cut_off("header of a record", header_size, file_.size() - offset_);
    return std::nullopt;
  }
  if (header_size == 0 || header_size > kMaxHeaderBytes) {  // zeros are what a power cut leaves at the end of a file
    end("");
    return fail_at(position, ErrorCode::parse, "header of {} bytes, expected 1 to {}", header_size, kMaxHeaderBytes);
  }
  if (auto ok = file_.read(offset_, header_size, header); !ok) return tl::unexpected(ok.error());
  offset_ += header_size;
  auto record = parse_header(header, position);
  std::uint64_t size = 0;
  const auto has_data = counted("length of a record", size);
  if (!has_data || !*has_data)
    return has_data ? Result<std::optional<Record>>(std::nullopt) : tl::unexpected(has_data.error());
  if (size > file_.size() - offset_) {
    cut_off(fmt::format("record {}", record ? name_of(record->op) : "of unknown kind"), size, file_.size() - offset_);
    size = file_.size() - offset_;
  }
  const std::uint64_t begin = std::exchange(offset_, offset_ + size);
  if (!record) return tl::unexpected(record.error());  // the next one stands where this one's data ends
  record->data_size = size;
  data_.clear();
  if (record->op == Op::bag_header || record->op == Op::index) return *record;
  if (const auto most = record->op == Op::chunk ? internal::kMaxChunkBytes : internal::kMaxMessageBytes; size > most)
    return fail_at(position, ErrorCode::unsupported, "record {} of {} bytes, expected at most {}", name_of(record->op),
                   size, most);
  if (auto ok = file_.read(begin, size, data_); !ok) return tl::unexpected(ok.error());
  return *record;
}

Status Ros1Reader::define(const Record& record, std::string_view data) {
  BagChannel channel{.topic = record.topic, .type = {}, .message_encoding = "ros1"};
  const auto wrong = for_fields(data, [&](std::string_view name, std::string_view value) {
    if (name == "type") channel.type = type_of_ros2(std::string(value));
  });
  if (wrong) return fail_at(record.position, ErrorCode::parse, "connection {}: {}", record.connection, *wrong);
  const auto [at, is_new] = channels_.try_emplace(record.connection, channel);
  if (!is_new && at->second != channel && complained_of_.emplace(record.op, record.connection).second)
    return fail_at(record.position, ErrorCode::invalid,
                   "connection {} is '{:.80}' ({:.80}), expected '{:.80}' ({:.80}) as before", record.connection,
                   channel.topic, channel.type, at->second.topic, at->second.type);
  return {};
}

Result<std::optional<BagMessage>> Ros1Reader::take(const Record& record, std::string_view data) {
  if (record.op == Op::connection) {
    if (auto ok = define(record, data); !ok) return tl::unexpected(ok.error());
    return std::nullopt;
  }
  if (record.op != Op::message) return std::nullopt;
  const auto channel = channels_.find(record.connection);
  if (channel == channels_.end() && !complained_of_.emplace(record.op, record.connection).second) return std::nullopt;
  if (channel == channels_.end())
    return fail_at(record.position, ErrorCode::invalid, "message of connection {}, expected one that is defined before",
                   record.connection);
  return BagMessage{.channel = &channel->second,
                    .log_time = record.time,
                    .publish_time = record.time,
                    .data = data,
                    .position = record.position};
}

Status Ros1Reader::enter_chunk(const Record& record) {
  auto chunk = internal::unpack_chunk(data_, record.compression == "none" ? "" : record.compression, record.size, cut_,
                                      std::exchange(chunk_, {}));
  if (!chunk) return fail_at(record.position, chunk.error().code, "chunk: {}", chunk.error().message);
  data_.clear();
  data_.shrink_to_fit();  // the packed chunk is not kept beside the unpacked one
  chunk_ = std::move(*chunk);
  chunk_at_ = 0;
  chunk_offset_ = record.position.at;
  chunk_cut_ = cut_;
  complained_of_.clear();
  ++chunks_read_;
  return {};
}

Result<std::optional<BagMessage>> Ros1Reader::next_of_file() {
  if (ended_) return std::nullopt;
  const auto record = next_record();
  if (!record && record.error().code == ErrorCode::io) end("");
  if (!record) return tl::unexpected(record.error());
  if (!*record) return std::nullopt;
  if ((*record)->op == Op::chunk) {
    if (auto ok = enter_chunk(**record); !ok) return tl::unexpected(ok.error());
    return std::nullopt;
  }
  return cut_ ? Result<std::optional<BagMessage>>(std::nullopt) : take(**record, data_);
}

Result<std::optional<BagMessage>> Ros1Reader::next_of_chunk() {
  const BagPosition position{.at = chunk_offset_, .inside = chunk_at_};
  Cursor cursor(std::string_view(chunk_).substr(chunk_at_));
  if (cursor.left() == 0) {
    chunk_.clear();
    return std::nullopt;
  }
  const std::string_view header = cursor.counted("header of a record");
  const std::string_view data = cursor.counted("data of a record");
  if (!cursor.ok()) {
    Result<std::optional<BagMessage>> out = std::nullopt;
    if (!chunk_cut_) out = fail_at(position, ErrorCode::parse, "{}", *cursor.error());
    chunk_.clear();
    return out;
  }
  chunk_at_ += cursor.at();
  const auto record = parse_header(header, position);
  auto out = record ? take(*record, data) : tl::unexpected(record.error());
  if (!out && out.error().code == ErrorCode::parse) {
    out.error().message += fmt::format("; {} bytes behind it are not read", chunk_.size() - chunk_at_);
    chunk_.clear();
  }
  return out;
}

Result<std::optional<BagMessage>> Ros1Reader::next() {
  while (true) {
    auto message = chunk_.empty() ? next_of_file() : next_of_chunk();
    if (!message || *message || (ended_ && chunk_.empty())) return message;
  }
}

Status Ros1Reader::seek(const BagPosition& position) {
  if (!all_defined_) {  // what stands before the message may define what it is: all is read once
    while (true)
      if (const auto message = next(); message && !*message) break;
    all_defined_ = true;
  }
  if (chunk_.empty() || chunk_offset_ != position.at) {
    chunk_.clear();
    ended_ = cut_ = false;
    offset_ = position.at;
    const auto record = next_record();
    if (!record) return tl::unexpected(record.error());
    if (!*record || (*record)->op != Op::chunk) {
      offset_ = position.at;
      ended_ = cut_ = false;
      return {};
    }
    if (auto ok = enter_chunk(**record); !ok) return ok;
  }
  if (position.inside > chunk_.size())
    return fail_at(position, ErrorCode::parse, "chunk of {} bytes: has the file changed?", chunk_.size());
  chunk_at_ = position.inside;
  return {};
}

std::vector<const BagChannel*> Ros1Reader::channels() const {
  std::vector<const BagChannel*> out;
  for (const auto& [id, channel] : channels_) out.push_back(&channel);
  return out;
}

}  // namespace tutti::bags
