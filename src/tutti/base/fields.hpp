// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>
#include <type_traits>
#include <vector>

#include "tutti/base/plain_text.hpp"

/// The fields of a message or record, listed once, as base/config.hpp does it for settings:
///
///   struct Battery {
///     double voltage_v = 0.0;
///     template <class V> void describe(V& v) {
///       v.field(1, "voltage_v", voltage_v, {.low = 0.0}, "The main battery's voltage.");
///     }
///   };
///
/// From that list follow the bytes of a protobuf message and their checks (wire/field_bytes.hpp), JSON
/// (program/field_json.hpp), texts and tables (base/field_text.hpp), and random values for tests. Fields are listed in
/// the order of their numbers. A number and its type are on the wire and in stores: never reuse one. The version of a
/// message's kind is raised only when a reader of before would misunderstand a message; a new field, which it passes
/// over, needs none.
///
/// Types: bool, integers, double, std::string, enums with a range, Timestamp, RobotId, Pose3, Matrix6d (symmetric),
/// structs with such a list, std::optional and std::vector of all these, and NumberSets by session (std::map).
/// A struct that has `using InColumns = void;` and has scalars only is coded in columns where it is in a list: of each
/// of its fields all values, side by side.
namespace tutti {

struct FieldRule {
  enum class Text : std::uint8_t {
    plain,  ///< As plain_text() returns it.
    word,   ///< Printable ASCII without blanks.
    name,   ///< 1 to 64 letters, digits, '_' and '-'.
    any     ///< Any bytes.
  };
  Text text = Text::plain;
  std::size_t at_least = 0;                               ///< Bytes of a text.
  std::size_t at_most = kPlainTextBytes;                  ///< Bytes of a text, elements of a list.
  double low = -std::numeric_limits<double>::infinity();  ///< Range of a number, both ends included.
  double high = std::numeric_limits<double>::infinity();
  bool fixed = false;   ///< An integer that uses all its bits, such as a hash: takes all its bytes on the wire.
  bool always = false;  ///< On the wire also with its default; a pose or covariance must be there.
  /// The page refuses a record without this field; of any other that is missing it takes the default.
  bool is_needed = false;
  bool is_flat = false;  ///< JSON has the fields of this struct beside those of its owner.
  /// On the wire the fields of this struct, or the columns of this list, are beside those of their owner, with this
  /// field's number added to theirs; this number itself states whether an optional one is there.
  bool is_spread = false;
  const char* column = "";  ///< Heading in tables for people; empty: in none.
};

namespace fields_internal {
struct AnyVisitor {
  template <class T>
  void field(int, const char*, T&, const FieldRule& = {}, const char* = "") {}
};
template <class T>
struct element_of {};
template <class T>
struct element_of<std::optional<T>> {
  using type = T;
};
template <class T>
struct element_of<std::vector<T>> {
  using type = T;
};
}  // namespace fields_internal

/// A struct that lists its fields.
template <class T>
concept HasFields = requires(T value, fields_internal::AnyVisitor v) {
  value.describe(v);
};
template <class T>
concept IsOptionalField = std::same_as<T, std::optional<typename fields_internal::element_of<T>::type>>;
template <class T>
concept IsListField = std::same_as<T, std::vector<typename fields_internal::element_of<T>::type>>;
template <class T>
concept IsColumnsField = IsListField<T> && requires {
  typename T::value_type::InColumns;
};
template <class T>
concept IsNumbersField = IsListField<T> && std::is_arithmetic_v<typename fields_internal::element_of<T>::type>;

/// Shows a visitor that changes nothing every field of a value.
template <HasFields T, class V>
void visit_fields(const T& value, V& visitor) {
  const_cast<T&>(value).describe(visitor);  // NOLINT: one list serves readers and writers
}

}  // namespace tutti
