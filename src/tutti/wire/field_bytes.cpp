// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/field_bytes.hpp"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <cmath>

#include "tutti/geometry/covariance.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

constexpr std::size_t kMaxWireFields = 100'000;  // in one message, of those that are described by lists
constexpr std::size_t kMaxSmallFields = 20;      // that most messages have at most
constexpr int kSession = 1, kBound = 2;          // fields of a set's message

bool is_letter_of_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
}
Status unreadable() { return fail(ErrorCode::parse, "not the protobuf message expected"); }

CodedInputStream stream_of(std::string_view bytes) {
  return CodedInputStream(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
}

/// Reads what follows a tag of `type`; false if it is cut short or of a type that proto3 has not.
bool read_value(CodedInputStream& in, std::string_view message, WireField& field) {
  switch (field.type) {
    case WireFormatLite::WIRETYPE_VARINT:
      return in.ReadVarint64(&field.value);
    case WireFormatLite::WIRETYPE_FIXED64:
      return in.ReadLittleEndian64(&field.value);
    case WireFormatLite::WIRETYPE_FIXED32: {
      std::uint32_t value = 0;
      const bool is_read = in.ReadLittleEndian32(&value);
      field.value = value;
      return is_read;
    }
    case WireFormatLite::WIRETYPE_LENGTH_DELIMITED: {
      std::uint32_t length = 0;
      if (!in.ReadVarint32(&length)) return false;
      const auto begin = static_cast<std::size_t>(in.CurrentPosition());
      if (length > message.size() - begin) return false;
      field.bytes = message.substr(begin, length);
      return in.Skip(static_cast<int>(length));
    }
    default:
      return false;
  }
}

/// Appends the numbers of a packed field; false if the last is cut short.
bool unpack(std::string_view packed, bool are_doubles, std::vector<std::uint64_t>& out) {
  CodedInputStream in = stream_of(packed);
  for (std::uint64_t value = 0; static_cast<std::size_t>(in.CurrentPosition()) < packed.size(); out.push_back(value))
    if (!(are_doubles ? in.ReadLittleEndian64(&value) : in.ReadVarint64(&value))) return false;
  return true;
}

}  // namespace

bool WireField::has_bytes() const { return type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED; }
bool WireField::is_varint() const { return type == WireFormatLite::WIRETYPE_VARINT; }
bool WireField::is_double() const { return type == WireFormatLite::WIRETYPE_FIXED64; }

Result<WireFields> split_fields(std::string_view message) {
  CodedInputStream in = stream_of(message);
  WireFields out;
  out.reserve(std::min(message.size() / 2, kMaxSmallFields));
  while (const std::uint32_t tag = in.ReadTag()) {
    WireField field{.number = WireFormatLite::GetTagFieldNumber(tag), .type = WireFormatLite::GetTagWireType(tag)};
    if (field.number == 0 || !read_value(in, message, field)) return tl::unexpected(unreadable().error());
    if (out.size() == kMaxWireFields)
      return fail(ErrorCode::invalid, "more than {} fields in one message", kMaxWireFields);
    out.push_back(field);
  }
  if (!in.ConsumedEntireMessage()) return tl::unexpected(unreadable().error());
  return out;
}

Result<std::vector<std::uint64_t>> repeated_numbers(const WireFields& fields, int number, bool are_doubles,
                                                    std::size_t at_most) {
  const auto ends_varint = [](char byte) { return (static_cast<unsigned char>(byte) & 0x80U) == 0; };
  std::vector<std::uint64_t> out;
  for (const WireField& field : fields) {
    const bool is_one = are_doubles ? field.is_double() : field.is_varint();
    if (field.number != number || (!is_one && !field.has_bytes())) continue;
    const auto packed = are_doubles ? static_cast<std::ptrdiff_t>(field.bytes.size() / sizeof(double))
                                    : std::ranges::count_if(field.bytes, ends_varint);
    const std::size_t count = out.size() + (is_one ? 1 : static_cast<std::size_t>(packed));
    if (count > at_most) return fail(ErrorCode::invalid, "{} or more, at most {} are accepted", count, at_most);
    out.reserve(count);
    if (is_one)
      out.push_back(field.value);
    else if (!unpack(field.bytes, are_doubles, out))
      return tl::unexpected(unreadable().error());
  }
  return out;
}

std::uint64_t zigzag(std::int64_t value) { return WireFormatLite::ZigZagEncode64(value); }
std::int64_t from_zigzag(std::uint64_t value) { return WireFormatLite::ZigZagDecode64(value); }
void append_varint(std::string& out, std::uint64_t value) {
  for (; value >= 0x80U; value >>= 7U) out.push_back(static_cast<char>(value | 0x80U));
  out.push_back(static_cast<char>(value));
}
void append_fixed(std::string& out, std::uint64_t value, std::size_t bytes) {
  for (; bytes > 0; --bytes, value >>= 8U) out.push_back(static_cast<char>(value));
}
void append_tag(std::string& out, int number, std::size_t fixed_bytes) {
  const auto type = fixed_bytes == 0                       ? WireFormatLite::WIRETYPE_VARINT
                    : fixed_bytes <= sizeof(std::uint32_t) ? WireFormatLite::WIRETYPE_FIXED32
                                                           : WireFormatLite::WIRETYPE_FIXED64;
  append_varint(out, WireFormatLite::MakeTag(number, type));
}
void append_bytes(std::string& out, int number, std::string_view bytes) {
  append_varint(out, WireFormatLite::MakeTag(number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED));
  append_varint(out, bytes.size());
  out += bytes;
}
std::string set_bytes(std::uint64_t session, const NumberSet& numbers) {
  std::string out, bounds;
  std::uint64_t last = 0;
  for (const auto& [begin, end] : numbers.intervals()) {
    append_varint(bounds, begin - last);
    append_varint(bounds, end - begin);
    last = end;
  }
  if (session != 0) append_tag(out, kSession, 0), append_varint(out, session);
  if (!bounds.empty()) append_bytes(out, kBound, bounds);
  return out;
}

void FieldColumnWriter::finish(std::string& out) const {
  for (const auto& [number, column] : columns_)
    if (column.texts.empty())
      append_bytes(out, number + offset_, column.packed);
    else
      out += column.texts;
}

void FieldColumnReader::find(int number, const char* name, bool are_texts, bool are_doubles) {
  if (!status_) return;
  Column& column = columns_.emplace_back();
  auto numbers = repeated_numbers(fields_, number, are_doubles, are_texts ? 0 : at_most_);
  if (are_texts) {
    for (const WireField& field : fields_)
      if (field.number == number && field.has_bytes()) column.texts.push_back(field.bytes);
  } else if (numbers) {
    column.numbers = std::move(*numbers);
  } else {
    status_ = in_context(name, numbers.error());
  }
  if (status_ && column.size() != columns_.front().size())
    status_ = fail(ErrorCode::parse, "{}: a column of {}, expected {} as in the first", name, column.size(),
                   columns_.front().size());
}

WireFields FieldReader::fields_inside(int at, const char* name) {
  WireFields out;
  std::size_t count = 0;
  for (const WireField& field : fields_) {
    if (field.number != at || !field.has_bytes()) continue;
    auto inside = split_fields(field.bytes);
    if (!inside) return take(tl::unexpected(inside.error()), name), out;
    if (++count > 1) return refuse_count(count, name, 1), out;  // protobuf would merge them
    out = std::move(*inside);
  }
  return out;
}

std::vector<std::uint64_t> FieldReader::numbers(int at, const char* name, bool are_doubles, std::size_t at_most) {
  auto numbers = repeated_numbers(fields_, at, are_doubles, at_most);
  if (numbers) return std::move(*numbers);
  take(tl::unexpected(numbers.error()), name);
  return {};
}

Status FieldReader::read_set(std::string_view bytes, NumberSets& sets) {
  const auto fields = split_fields(bytes);
  if (!fields) return tl::unexpected(fields.error());
  const auto bounds = repeated_numbers(*fields, kBound, false, 2 * kMaxIntervals);
  if (!bounds) return tl::unexpected(bounds.error());
  std::uint64_t session = 0, last = 0;
  for (const WireField& field : *fields)
    if (field.number == kSession && field.is_varint()) session = field.value;
  const auto [numbers, is_new] = sets.try_emplace(session);
  if (!is_new) return fail(ErrorCode::invalid, "session {} twice", session);
  for (std::size_t i = 0; i + 1 < bounds->size(); i += 2) {
    const std::uint64_t begin = last + (*bounds)[i];
    last = begin + (*bounds)[i + 1];
    if (!numbers->second.append({begin, last})) return fail(ErrorCode::invalid, "segments that touch");
  }
  return {};
}

void FieldReader::refuse_count(std::size_t count, const char* name, std::size_t at_most) {
  take(fail(ErrorCode::invalid, "{} or more, at most {} are accepted", count, at_most), name);
}

void FieldReader::refuse_numbers(std::size_t count, const char* name, std::size_t expected, bool is_needed) {
  if (count > 0 || is_needed) take(fail(ErrorCode::parse, "{} numbers, expected {}", count, expected), name);
}

void FieldReader::take(const Status& status, const char* name) {
  if (status_ && !status) status_ = in_context(name, status.error());
}

Status FieldChecker::check_value(const std::string& text, const FieldRule& rule) {
  using Text = FieldRule::Text;
  if (rule.text == Text::name) {
    if (!text.empty() && text.size() <= kMaxNameBytes && std::ranges::all_of(text, is_letter_of_name)) return {};
    return fail(ErrorCode::invalid, "a name of {} letters, expected 1 to {} letters, digits, '_' and '-'", text.size(),
                kMaxNameBytes);
  }
  const char first = rule.text == Text::plain ? ' ' : '!';
  const bool is_printable =
      rule.text == Text::any || std::ranges::all_of(text, [&](char c) { return c >= first && c <= '~'; });
  if (text.size() >= rule.at_least && text.size() <= rule.at_most && is_printable) return {};
  return fail(ErrorCode::invalid, "a text of {} bytes, expected {} to {}{}", text.size(), rule.at_least, rule.at_most,
              rule.text == Text::any     ? ""
              : rule.text == Text::plain ? " of printable ASCII"
                                         : " of printable ASCII without blanks");
}

Status FieldChecker::check_number(double value, const FieldRule& rule) {
  if (std::isfinite(value) && value >= rule.low && value <= rule.high) return {};
  if (rule.low == FieldRule().low && rule.high == FieldRule().high)
    return fail(ErrorCode::invalid, "{}, expected a finite number", value);
  return fail(ErrorCode::invalid, "{}, expected {} to {}", value, rule.low, rule.high);
}

Status FieldChecker::check_value(const Pose3& T, const FieldRule& /*rule*/) {
  if (!is_valid(T))
    return fail(ErrorCode::invalid, "pose is not finite or its quaternion has norm {}, expected 1", T.rotation.norm());
  const double largest = T.translation.cwiseAbs().maxCoeff();
  if (largest > kMaxCoordinate_m)
    return fail(ErrorCode::invalid, "coordinate of {} m, at most {} m", largest, kMaxCoordinate_m);
  return {};
}

Status FieldChecker::check_value(const Matrix6d& covariance, const FieldRule& /*rule*/) {
  if (auto ok = check_covariance(covariance); !ok) return ok;
  const double largest = covariance.cwiseAbs().maxCoeff();
  if (largest > kMaxVariance)
    return fail(ErrorCode::invalid, "covariance entry of {}, at most {}", largest, kMaxVariance);
  return {};
}

Status FieldChecker::check_value(const NumberSets& sets, const FieldRule& rule) {
  std::size_t intervals = 0;
  for (const auto& [session, numbers] : sets) {
    intervals += numbers.intervals().size();
    if (!numbers.intervals().empty() && numbers.intervals().back().end > std::uint64_t{1} << 32U)
      return fail(ErrorCode::invalid, "a submap with a number of more than 32 bits");
  }
  if (sets.size() <= rule.at_most && intervals <= kMaxIntervals) return {};
  return fail(ErrorCode::invalid, "{} sessions and {} segments, at most {} and {} are accepted", sets.size(), intervals,
              rule.at_most, kMaxIntervals);
}

Status FieldChecker::too_many(std::size_t count, std::size_t at_most) {
  return fail(ErrorCode::invalid, "{}, at most {} are accepted", count, at_most);
}

void FieldChecker::take(const Status& status, const char* name) {
  if (status_ && !status) status_ = in_context(name, status.error());
}

}  // namespace tutti::wire
