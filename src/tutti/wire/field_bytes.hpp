// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "tutti/base/fields.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"

/// A value as the protobuf message that its list of fields (base/fields.hpp) describes, and back. proto/ has the same
/// messages for other languages; field_bytes_test holds the two equal.
///
/// proto3's types: bool bool, unsigned integers and enums uint32 or uint64 (fixed32, fixed64 with FieldRule::fixed),
/// signed ones sint64, double double, text bytes, Timestamp sint64 (ns), RobotId uint32, Pose3 repeated double
/// [x y z; quaternion x y z w]. What has its default is left out, unless it is an optional or an element of a list.
namespace tutti::wire {

template <HasFields T>
std::string field_bytes(const T& value);

/// Appends fields to a message. Deterministic: the same value gives the same bytes.
class FieldWriter {
 public:
  explicit FieldWriter(std::string& out) : out_(out) {}

  template <class T>
  void field(int number, const char* /*name*/, const T& value, const FieldRule& rule = {}, const char* /*help*/ = "") {
    if constexpr (IsOptionalField<T>) {
      if (value) put(number, *value, rule);
    } else if constexpr (IsListField<T>) {
      for (const auto& element : value) put(number, element, rule);
    } else if constexpr (HasFields<T>) {
      if (const std::string inside = field_bytes(value); !inside.empty()) put_bytes(number, inside);
    } else if (!(value == T{})) {
      put(number, value, rule);
    }
  }

 private:
  template <class T>
  void put(int number, const T& value, const FieldRule& rule) {
    if constexpr (HasFields<T>) {
      put_bytes(number, field_bytes(value));
    } else if constexpr (std::is_same_v<T, std::string>) {
      put_bytes(number, value);
    } else if constexpr (std::is_same_v<T, double>) {
      put_double(number, value);
    } else if constexpr (std::is_same_v<T, Timestamp>) {
      put_signed(number, value.ns);
    } else if constexpr (std::is_same_v<T, RobotId>) {
      put_unsigned(number, value.value);
    } else if constexpr (std::is_same_v<T, Pose3>) {
      put_pose(number, value);
    } else if constexpr (std::is_signed_v<T>) {
      put_signed(number, value);
    } else if (rule.fixed) {
      put_fixed(number, static_cast<std::uint64_t>(value), sizeof(T));
    } else {
      put_unsigned(number, static_cast<std::uint64_t>(value));
    }
  }
  void put_unsigned(int number, std::uint64_t value);
  void put_signed(int number, std::int64_t value);
  void put_fixed(int number, std::uint64_t value, std::size_t bytes);
  void put_double(int number, double value);
  void put_bytes(int number, std::string_view bytes);
  void put_pose(int number, const Pose3& T);
  std::string& out_;
};

/// One field of a message as it came: its number, how it is coded, and a number or bytes.
struct WireField {
  int number = 0;
  int type = 0;
  std::uint64_t value = 0;
  std::string_view bytes;
};
/// The fields of a message. Errors: no protobuf message, or more fields than any message of ours has.
Result<std::vector<WireField>> split_fields(std::string_view message);

/// Fills a value from a message's fields; those of numbers or types that it does not know it passes over.
class FieldReader {
 public:
  explicit FieldReader(std::vector<WireField> fields) : fields_(std::move(fields)) {}

  template <class T>
  void field(int number, const char* name, T& value, const FieldRule& rule = {}, const char* /*help*/ = "") {
    if constexpr (std::is_same_v<T, Pose3>) {
      take(read_pose(fields_, number, value), name);
    } else {
      std::size_t count = 0;
      for (const WireField& field : fields_) {
        if (!status_ || field.number != number) continue;
        if constexpr (IsListField<T>) {
          typename T::value_type element{};
          if (!read(field, name, element)) continue;
          if (++count > rule.at_most) return refuse_count(count, name, rule.at_most);
          value.push_back(std::move(element));
        } else if constexpr (IsOptionalField<T>) {
          typename T::value_type inner{};
          if (read(field, name, inner)) value = std::move(inner);
        } else {
          if (HasFields<T> && ++count > 1) return refuse_count(count, name, 1);  // protobuf would merge them
          read(field, name, value);
        }
      }
    }
  }
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  /// False if the field is coded as another type.
  template <class T>
  bool read(const WireField& field, const char* name, T& value) {
    if constexpr (HasFields<T>) {
      if (!is_bytes(field)) return false;
      auto inside = split_fields(field.bytes);
      if (!inside) {
        take(tl::unexpected(inside.error()), name);
        return false;
      }
      FieldReader reader(std::move(*inside));
      value.describe(reader);
      take(reader.status(), name);
      return reader.status().has_value();
    } else if constexpr (std::is_same_v<T, std::string>) {
      if (is_bytes(field)) value = field.bytes;
      return is_bytes(field);
    } else if constexpr (std::is_same_v<T, double>) {
      return read_double(field, value);
    } else if constexpr (std::is_same_v<T, Timestamp>) {
      return read_signed(field, value.ns);
    } else if constexpr (std::is_same_v<T, RobotId>) {
      return read(field, name, value.value);
    } else if constexpr (std::is_same_v<T, bool>) {
      if (is_integer(field)) value = field.value != 0;
      return is_integer(field);
    } else if constexpr (std::is_enum_v<T>) {
      using Number = std::underlying_type_t<T>;  // a number that it cannot hold is none of its values
      if (is_integer(field)) value = static_cast<T>(field.value <= Number(-1) ? static_cast<Number>(field.value) : 0);
      return is_integer(field);
    } else if constexpr (std::is_signed_v<T>) {
      std::int64_t wide = 0;
      const bool is_read = read_signed(field, wide);
      if (is_read) value = static_cast<T>(wide);
      return is_read;
    } else {
      if (is_integer(field)) value = static_cast<T>(field.value);
      return is_integer(field);
    }
  }
  static bool is_bytes(const WireField& field);
  static bool is_integer(const WireField& field);  ///< Of any coding but sint's.
  static bool read_signed(const WireField& field, std::int64_t& value);
  static bool read_double(const WireField& field, double& value);
  static Status read_pose(const std::vector<WireField>& fields, int number, Pose3& value);
  void refuse_count(std::size_t count, const char* name, std::size_t at_most);
  void take(const Status& status, const char* name);
  std::vector<WireField> fields_;
  Status status_;
};

/// Holds every field to its rule; numbers must be finite, poses valid.
class FieldChecker {
 public:
  template <class T>
  void field(int /*number*/, const char* name, const T& value, const FieldRule& rule = {}, const char* /*help*/ = "") {
    if (!status_) return;
    if constexpr (IsOptionalField<T>) {
      if (value) take(check(*value, rule), name);
    } else if constexpr (IsListField<T>) {
      if (value.size() > rule.at_most) return take(check_count(value.size(), rule.at_most), name);
      for (const auto& element : value)
        if (status_) take(check(element, rule), name);
    } else {
      take(check(value, rule), name);
    }
  }
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  template <class T>
  static Status check(const T& value, const FieldRule& rule) {
    if constexpr (HasFields<T>) {
      FieldChecker inside;
      visit_fields(value, inside);
      return inside.status();
    } else if constexpr (std::is_same_v<T, std::string>) {
      return check_text(value, rule);
    } else if constexpr (std::is_same_v<T, Pose3>) {
      return check_pose(value);
    } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      return check_number(static_cast<double>(value), rule);
    } else {
      return {};
    }
  }
  static Status check_text(const std::string& text, const FieldRule& rule);
  static Status check_number(double value, const FieldRule& rule);
  static Status check_pose(const Pose3& T);
  static Status check_count(std::size_t count, std::size_t at_most);
  void take(const Status& status, const char* name);
  Status status_;
};

template <HasFields T>
std::string field_bytes(const T& value) {
  std::string out;
  FieldWriter writer(out);
  visit_fields(value, writer);
  return out;
}

template <HasFields T>
Status check_fields(const T& value) {
  FieldChecker checker;
  visit_fields(value, checker);
  return checker.status();
}

/// The value of these bytes, not checked.
template <HasFields T>
Result<T> read_fields(std::string_view bytes) {
  auto fields = split_fields(bytes);
  if (!fields) return tl::unexpected(fields.error());
  FieldReader reader(std::move(*fields));
  T value;
  value.describe(reader);
  if (!reader.status()) return tl::unexpected(reader.status().error());
  return value;
}

}  // namespace tutti::wire
