// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "tutti/base/fields.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/base/number_set.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"

/// The parts of protobuf messages: fields as they come, and numbers as their bytes.
namespace tutti::wire {

/// One field of a message as it came: its number, how it is coded, and a number or bytes.
struct WireField {
  int number = 0;
  int type = 0;
  std::uint64_t value = 0;
  std::string_view bytes;

  [[nodiscard]] bool has_bytes() const;
  [[nodiscard]] bool is_varint() const;
  [[nodiscard]] bool is_double() const;
};
using WireFields = std::vector<WireField>;
/// The fields of a message. Errors: no protobuf message, or more fields than any message of ours has.
Result<WireFields> split_fields(std::string_view message);
/// The numbers of a repeated field of doubles or varints, packed or one by one.
Result<std::vector<std::uint64_t>> repeated_numbers(const WireFields& fields, int number, bool are_doubles,
                                                    std::size_t at_most);

void append_varint(std::string& out, std::uint64_t value);
void append_fixed(std::string& out, std::uint64_t value, std::size_t bytes);
void append_tag(std::string& out, int number, std::size_t fixed_bytes);   ///< 0: of a varint.
void append_bytes(std::string& out, int number, std::string_view bytes);  ///< As the field of this number.
/// Numbers of a session, as the message that they are in NumberSets.
using NumberSets = std::map<std::uint64_t, NumberSet>;
std::string set_bytes(std::uint64_t session, const NumberSet& numbers);
std::uint64_t zigzag(std::int64_t value);
std::int64_t from_zigzag(std::uint64_t value);

/// How many numbers a type has that is a repeated double; 0: it is another.
template <class T>
constexpr std::size_t kNumbers = std::same_as<T, Pose3>      ? 7
                                 : std::same_as<T, Matrix6d> ? 21
                                                             : 0;

/// Passes each of a pose's or covariance's numbers, to be read or, if it is not const, to be set.
template <class T, class Pass>
void each_number(T& value, Pass&& pass) {
  if constexpr (std::same_as<std::remove_const_t<T>, Pose3>) {
    for (auto& x : value.translation) pass(x);
    for (auto& q : value.rotation.coeffs()) pass(q);
  } else {
    for (int i = 0; i < 6; ++i)
      for (int j = i; j < 6; ++j) {
        pass(value(i, j));
        if constexpr (!std::is_const_v<T>) value(j, i) = value(i, j);
      }
  }
}

/// A number, or the numbers of a pose or covariance, as a field has them behind its tag.
template <class T>
void append_value(std::string& out, const T& value, const FieldRule& rule = {}) {
  if constexpr (kNumbers < T >> 0)
    each_number(value, [&](double x) { append_value(out, x); });
  else if constexpr (std::is_same_v<T, double>)
    append_fixed(out, std::bit_cast<std::uint64_t>(value), sizeof value);
  else if constexpr (std::is_same_v<T, Timestamp>)
    append_varint(out, zigzag(value.ns));
  else if constexpr (std::is_same_v<T, RobotId>)
    append_varint(out, value.value);
  else if constexpr (std::is_signed_v<T>)
    append_varint(out, zigzag(value));
  else if (rule.fixed)
    append_fixed(out, static_cast<std::uint64_t>(value), sizeof value);
  else
    append_varint(out, static_cast<std::uint64_t>(value));
}

/// From the number in such a field.
template <class T>
void set_value(T& value, std::uint64_t coded) {
  if constexpr (std::is_same_v<T, double>) {
    value = std::bit_cast<double>(coded);
  } else if constexpr (std::is_same_v<T, Timestamp>) {
    value.ns = from_zigzag(coded);
  } else if constexpr (std::is_same_v<T, RobotId>) {
    value.value = static_cast<std::uint32_t>(coded);
  } else if constexpr (std::is_same_v<T, bool>) {
    value = coded != 0;
  } else if constexpr (std::is_enum_v<T>) {
    using Number = std::underlying_type_t<T>;  // a number outside its range is none of its values
    value = static_cast<T>(coded <= Number(-1) ? static_cast<Number>(coded) : Number(-1));
  } else if constexpr (std::is_signed_v<T>) {
    value = static_cast<T>(from_zigzag(coded));
  } else {
    value = static_cast<T>(coded);
  }
}

}  // namespace tutti::wire
