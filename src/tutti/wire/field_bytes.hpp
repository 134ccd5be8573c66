// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "tutti/base/fields.hpp"
#include "tutti/base/result.hpp"
#include "tutti/wire/field_columns.hpp"
#include "tutti/wire/field_values.hpp"

/// A value as the protobuf message that its list of fields (base/fields.hpp) describes, and back. proto/ has the same
/// messages for other languages; field_bytes_test checks that the two are equal.
///
/// proto3's types: bool bool, unsigned integers and enums uint32 or uint64 (fixed32, fixed64 with FieldRule::fixed),
/// signed ones sint64, double double, text bytes, Timestamp sint64 (ns), RobotId uint32, Pose3 repeated double
/// [x y z; quaternion x y z w], Matrix6d repeated double (its upper triangle by rows), lists of numbers packed. A list
/// in columns is one message with a repeated field for each field of its elements, and NumberSets are a message each,
/// of the session and the bounds of the set's intervals as differences. A field that has its default is left out,
/// unless it is an optional or an element of a list, or FieldRule::always demands it.
namespace tutti::wire {

template <class T>
concept IsOptionalStruct = IsOptionalField<T> && HasFields<typename fields_internal::element_of<T>::type>;

template <HasFields T>
std::string field_bytes(const T& value);

/// Appends fields to a message. Deterministic: the same value gives the same bytes.
class FieldWriter {
 public:
  explicit FieldWriter(std::string& out) : out_(out) {}

  template <class T>
  void field(int number, const char* /*name*/, const T& value, const FieldRule& rule = {}, const char* /*help*/ = "") {
    const int at = number + offset_;
    if constexpr (IsColumnsField<T>) {
      FieldColumnWriter columns(rule.is_spread ? at : 0);
      for (const auto& element : value) visit_fields(element, columns);
      if (rule.is_spread) return columns.finish(out_);
      std::string inside;
      columns.finish(inside);
      if (rule.always || !value.empty()) append_bytes(out_, at, inside);
    } else if constexpr (IsNumbersField<T>) {
      std::string packed;
      for (const auto element : value) append_value(packed, element);
      if (!packed.empty()) append_bytes(out_, at, packed);
    } else if constexpr (IsOptionalField<T>) {
      if (!value) return;
      put(at, rule.is_spread, *value, rule);
    } else if constexpr (IsListField<T>) {
      for (const auto& element : value) put(at, false, element, rule);
    } else if constexpr (std::is_same_v<T, NumberSets>) {
      for (const auto& [session, numbers] : value) append_bytes(out_, at, set_bytes(session, numbers));
    } else if constexpr (HasFields<T>) {
      if (rule.is_spread) return spread(at, value);
      if (const std::string inside = field_bytes(value); !inside.empty()) append_bytes(out_, at, inside);
    } else if (rule.always || !(value == T{})) {
      put(at, false, value, rule);
    }
  }

 private:
  template <class T>
  void put(int at, bool is_spread, const T& value, const FieldRule& rule) {
    if constexpr (HasFields<T>) {
      if (!is_spread) return append_bytes(out_, at, field_bytes(value));
      append_tag(out_, at, 0);
      append_varint(out_, 1);
      spread(at, value);
    } else if constexpr (std::is_same_v<T, std::string>) {
      append_bytes(out_, at, value);
    } else if constexpr (kNumbers<T> > 0) {
      std::string packed;
      append_value(packed, value);
      append_bytes(out_, at, packed);
    } else {
      append_tag(out_, at, std::is_same_v<T, double> || rule.fixed ? sizeof(T) : 0);
      append_value(out_, value, rule);
    }
  }
  template <class T>
  void spread(int at, const T& value) {
    const int outside = std::exchange(offset_, at);
    visit_fields(value, *this);
    offset_ = outside;
  }
  std::string& out_;
  int offset_ = 0;
};

/// Fills a value from a message's fields; those of numbers or types that it does not know it passes over.
class FieldReader {
 public:
  explicit FieldReader(WireFields fields) : fields_(std::move(fields)) {}

  /// All of a value. Its after_reading() may add what follows from them.
  template <HasFields T>
  Status fill(T& value) {
    value.describe(*this);
    if constexpr (requires { value.after_reading(); }) value.after_reading();
    return status_;
  }
  template <class T>
  void field(int number, const char* name, T& value, const FieldRule& rule = {}, const char* /*help*/ = "") {
    if (!status_) return;
    const int at = number + offset_;
    if constexpr (IsColumnsField<T>) {
      if (rule.is_spread) return take(FieldColumnReader(fields_, at, rule.at_most).read(value), name);
      const WireFields inside = fields_inside(at, name);
      take(FieldColumnReader(inside, 0, rule.at_most).read(value), name);
    } else if constexpr (IsNumbersField<T>) {
      const auto coded = numbers(at, name, std::is_same_v<T, std::vector<double>>, rule.at_most);
      value.resize(coded.size());
      for (std::size_t i = 0; i < coded.size(); ++i) set_value(value[i], coded[i]);
    } else if constexpr (kNumbers<T> > 0) {
      const auto coded = numbers(at, name, true, kNumbers<T>);
      if (coded.size() != kNumbers<T>) return refuse_numbers(coded.size(), name, kNumbers<T>, rule.always);
      each_number(value, [next = coded.begin()](double& x) mutable { set_value(x, *next++); });
    } else {
      if constexpr (HasFields<T>)
        if (rule.is_spread) return spread(at, value);
      if constexpr (IsOptionalStruct<T>)
        if (rule.is_spread) return spread_optional(number, name, value);
      if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) value = T{};
      std::size_t count = 0;
      for (const WireField& field : fields_)
        if (status_ && field.number == at) read(field, name, value, rule, count);
    }
  }

 private:
  /// One of perhaps several fields with the value's number.
  template <class T>
  void read(const WireField& field, const char* name, T& value, const FieldRule& rule, std::size_t& count) {
    if constexpr (IsListField<T>) {
      typename T::value_type element{};
      if (!read(field, name, element)) return;
      if (++count > rule.at_most) return refuse_count(count, name, rule.at_most);
      value.push_back(std::move(element));
    } else if constexpr (IsOptionalField<T>) {
      typename T::value_type inner{};
      if (read(field, name, inner)) value = std::move(inner);
    } else if constexpr (std::is_same_v<T, NumberSets>) {
      if (++count > rule.at_most) return refuse_count(count, name, rule.at_most);
      take(read_set(field.bytes, value), name);
    } else {
      if (HasFields<T> && ++count > 1) return refuse_count(count, name, 1);  // protobuf would merge them
      read(field, name, value);
    }
  }
  /// False if the field is coded as another type.
  template <class T>
  bool read(const WireField& field, const char* name, T& value) {
    constexpr bool kIsSigned = std::is_same_v<T, Timestamp> || (std::is_integral_v<T> && std::is_signed_v<T>);
    if constexpr (HasFields<T>) {
      if (!field.has_bytes()) return false;
      auto inside = split_fields(field.bytes);
      take(inside ? FieldReader(std::move(*inside)).fill(value) : Status(tl::unexpected(inside.error())), name);
      return status_.has_value();
    } else if constexpr (std::is_same_v<T, std::string>) {
      if (field.has_bytes()) value = field.bytes;
      return field.has_bytes();
    } else {
      const bool is_right = std::is_same_v<T, double> ? field.is_double()
                            : kIsSigned               ? field.is_varint()
                                                      : !field.has_bytes();
      if (is_right) set_value(value, field.value);
      return is_right;
    }
  }
  template <class T>
  void spread_optional(int number, const char* name, std::optional<T>& value) {
    bool is_there = false;
    field(number, name, is_there);
    if (!is_there) return;
    value = T();  // not emplace(): for Clang, a struct within another is not constructible while that is incomplete
    spread(number + offset_, *value);
  }
  template <class T>
  void spread(int at, T& value) {
    const int outside = std::exchange(offset_, at);
    value.describe(*this);
    offset_ = outside;
  }
  WireFields fields_inside(int at, const char* name);
  std::vector<std::uint64_t> numbers(int at, const char* name, bool are_doubles, std::size_t at_most);
  static Status read_set(std::string_view bytes, NumberSets& sets);
  void refuse_count(std::size_t count, const char* name, std::size_t at_most);
  void refuse_numbers(std::size_t count, const char* name, std::size_t expected, bool is_needed);
  void take(const Status& status, const char* name);
  WireFields fields_;
  int offset_ = 0;
  Status status_;
};

/// Checks every field against its rule; numbers must be finite, poses and covariances valid. A struct's check() may ask
/// for more, and its where() names which one is wrong.
class FieldChecker {
 public:
  template <class T>
  void field(int /*number*/, const char* name, const T& value, const FieldRule& rule = {}, const char* /*help*/ = "") {
    if (!status_) return;
    if constexpr (IsOptionalField<T>) {
      if (value) take(check(*value, rule), name);
    } else if constexpr (IsListField<T>) {
      if (value.size() > rule.at_most) return take(too_many(value.size(), rule.at_most), name);
      for (const auto& element : value)
        if (status_) take(check(element, rule), name);
    } else {
      take(check(value, rule), name);
    }
  }
  template <class T>
  static Status check(const T& value, const FieldRule& rule = {}) {
    static_assert(!IsOptionalField<T> && !IsListField<T>, "field() checks what is in them");
    if constexpr (HasFields<T>) {
      FieldChecker inside;
      visit_fields(value, inside);
      if constexpr (requires { value.check(); })
        if (inside.status_) inside.status_ = value.check();
      if constexpr (requires { value.where(); })
        if (!inside.status_) return in_context(value.where(), inside.status_.error());
      return inside.status_;
    } else if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      return check_number(static_cast<double>(value), rule);
    } else if constexpr (requires { check_value(value, rule); }) {
      return check_value(value, rule);
    } else {
      return {};
    }
  }
  static Status check_value(const Pose3& T, const FieldRule& rule = {});
  static Status check_value(const Matrix6d& covariance, const FieldRule& rule = {});

 private:
  static Status check_value(const std::string& text, const FieldRule& rule);
  static Status check_value(const NumberSets& sets, const FieldRule& rule);
  static Status check_number(double value, const FieldRule& rule);
  static Status too_many(std::size_t count, std::size_t at_most);
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
  return FieldChecker::check(value);
}

/// The value of these bytes, not checked.
template <HasFields T>
Result<T> read_fields(std::string_view bytes) {
  auto fields = split_fields(bytes);
  if (!fields) return tl::unexpected(fields.error());
  T value;
  if (auto ok = FieldReader(std::move(*fields)).fill(value); !ok) return tl::unexpected(ok.error());
  return value;
}

}  // namespace tutti::wire
