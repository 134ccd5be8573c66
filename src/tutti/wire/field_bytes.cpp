// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/field_bytes.hpp"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "tutti/wire/internal/pose_numbers.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream, google::protobuf::io::CodedOutputStream;

constexpr std::size_t kMaxWireFields = 100'000;  // in one message, of those that are described by lists

template <class F>
void append(std::string& out, int number, WireFormatLite::WireType type, F&& write) {
  google::protobuf::io::StringOutputStream stream(&out);
  CodedOutputStream coded(&stream);
  coded.WriteTag(WireFormatLite::MakeTag(number, type));
  write(coded);
}

bool is_letter_of_name(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
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

}  // namespace

void FieldWriter::put_unsigned(int number, std::uint64_t value) {
  append(out_, number, WireFormatLite::WIRETYPE_VARINT, [&](auto& coded) { coded.WriteVarint64(value); });
}
void FieldWriter::put_signed(int number, std::int64_t value) {
  put_unsigned(number, WireFormatLite::ZigZagEncode64(value));
}
void FieldWriter::put_fixed(int number, std::uint64_t value, std::size_t bytes) {
  const bool is_short = bytes <= 4;
  append(out_, number, is_short ? WireFormatLite::WIRETYPE_FIXED32 : WireFormatLite::WIRETYPE_FIXED64,
         [&](auto& coded) {
           if (is_short)
             coded.WriteLittleEndian32(static_cast<std::uint32_t>(value));
           else
             coded.WriteLittleEndian64(value);
         });
}
void FieldWriter::put_double(int number, double value) { put_fixed(number, std::bit_cast<std::uint64_t>(value), 8); }
void FieldWriter::put_bytes(int number, std::string_view bytes) {
  append(out_, number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED, [&](auto& coded) {
    coded.WriteVarint32(static_cast<std::uint32_t>(bytes.size()));
    coded.WriteRaw(bytes.data(), static_cast<int>(bytes.size()));
  });
}
void FieldWriter::put_pose(int number, const Pose3& T) {
  Numbers numbers;
  write(T, numbers);
  append(out_, number, WireFormatLite::WIRETYPE_LENGTH_DELIMITED, [&](auto& coded) {
    coded.WriteVarint32(static_cast<std::uint32_t>(sizeof(double)) * kPoseNumbers);
    for (const double x : numbers) coded.WriteLittleEndian64(std::bit_cast<std::uint64_t>(x));
  });
}

Result<std::vector<WireField>> split_fields(std::string_view message) {
  CodedInputStream in(reinterpret_cast<const std::uint8_t*>(message.data()), static_cast<int>(message.size()));
  std::vector<WireField> out;
  while (const std::uint32_t tag = in.ReadTag()) {
    WireField field{.number = WireFormatLite::GetTagFieldNumber(tag), .type = WireFormatLite::GetTagWireType(tag)};
    if (field.number == 0 || !read_value(in, message, field))
      return fail(ErrorCode::parse, "not the protobuf message expected");
    if (out.size() == kMaxWireFields)
      return fail(ErrorCode::invalid, "more than {} fields in one message", kMaxWireFields);
    out.push_back(field);
  }
  if (!in.ConsumedEntireMessage()) return fail(ErrorCode::parse, "not the protobuf message expected");
  return out;
}

bool FieldReader::is_bytes(const WireField& field) { return field.type == WireFormatLite::WIRETYPE_LENGTH_DELIMITED; }
bool FieldReader::is_integer(const WireField& field) { return !is_bytes(field); }

bool FieldReader::read_signed(const WireField& field, std::int64_t& value) {
  if (field.type != WireFormatLite::WIRETYPE_VARINT) return false;
  value = WireFormatLite::ZigZagDecode64(field.value);
  return true;
}

bool FieldReader::read_double(const WireField& field, double& value) {
  if (field.type != WireFormatLite::WIRETYPE_FIXED64) return false;
  value = std::bit_cast<double>(field.value);
  return true;
}

/// Its numbers are in one field or, as protobuf allows, in one each.
Status FieldReader::read_pose(const std::vector<WireField>& fields, int number, Pose3& value) {
  Numbers numbers;
  std::size_t count = 0;
  for (const WireField& field : fields) {
    if (field.number != number) continue;
    double x = 0.0;
    if (read_double(field, x) && ++count <= kPoseNumbers) numbers.Add(x);
    if (!is_bytes(field)) continue;
    if (field.bytes.size() % sizeof(double) != 0) return fail(ErrorCode::parse, "not the protobuf message expected");
    for (std::size_t at = 0; at < field.bytes.size(); at += sizeof(double)) {
      std::uint64_t bits = 0;
      CodedInputStream::ReadLittleEndian64FromArray(reinterpret_cast<const std::uint8_t*>(field.bytes.data()) + at,
                                                    &bits);
      if (++count <= kPoseNumbers) numbers.Add(std::bit_cast<double>(bits));
    }
  }
  if (count == kPoseNumbers)
    value = wire::read_pose(numbers, 0);
  else if (count != 0)
    return fail(ErrorCode::parse, "a pose of {} numbers, expected {}", count, kPoseNumbers);
  return {};
}

void FieldReader::refuse_count(std::size_t count, const char* name, std::size_t at_most) {
  take(fail(ErrorCode::invalid, "{} or more, at most {} are accepted", count, at_most), name);
}

void FieldReader::take(const Status& status, const char* name) {
  if (status_ && !status) status_ = in_context(name, status.error());
}

Status FieldChecker::check_text(const std::string& text, const FieldRule& rule) {
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
  return fail(ErrorCode::invalid, "{}, expected {} to {}", value, rule.low, rule.high);
}

Status FieldChecker::check_pose(const Pose3& T) {
  if (is_valid(T) && T.translation.cwiseAbs().maxCoeff() <= kMaxCoordinate_m) return {};
  return fail(ErrorCode::invalid, "no valid pose");
}

Status FieldChecker::check_count(std::size_t count, std::size_t at_most) {
  return fail(ErrorCode::invalid, "{}, at most {} are accepted", count, at_most);
}

void FieldChecker::take(const Status& status, const char* name) {
  if (status_ && !status) status_ = in_context(name, status.error());
}

}  // namespace tutti::wire
