// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tutti/wire/field_values.hpp"

/// Lists in columns: of each field of their elements one repeated field.
namespace tutti::wire {

class FieldColumnWriter {
 public:
  /// `offset` is added to the numbers of the elements' fields.
  explicit FieldColumnWriter(int offset) : offset_(offset) {}

  template <class T>
  void field(int number, const char* /*name*/, const T& value, const FieldRule& rule = {}, const char* /*help*/ = "") {
    if constexpr (std::is_same_v<T, std::string>)
      append_bytes(columns_[number].texts, number + offset_, value);
    else
      append_value(columns_[number].packed, value, rule);
  }
  void finish(std::string& out) const;  ///< Appends them.

 private:
  struct Column {
    std::string packed;
    std::string texts;  // whole fields: bytes cannot be packed
  };
  std::map<int, Column> columns_;
  int offset_;
};

class FieldColumnReader {
 public:
  FieldColumnReader(const WireFields& fields, int offset, std::size_t at_most)
      : fields_(fields), offset_(offset), at_most_(at_most) {}

  /// Errors: columns that differ in length, or more than `at_most` elements.
  template <class T>
  Status read(std::vector<T>& list) {
    T any{};
    any.describe(*this);
    if (status_ && !columns_.empty()) list.resize(columns_.front().size());
    for (at_ = 0; at_ < list.size(); ++at_) {
      column_ = 0;
      list[at_].describe(*this);
    }
    return status_;
  }
  template <class T>
  void field(int number, const char* name, T& value, const FieldRule& /*rule*/ = {}, const char* /*help*/ = "") {
    if (column_ == kFinding)
      find(number + offset_, name, std::is_same_v<T, std::string>, std::is_same_v<T, double>);
    else if constexpr (std::is_same_v<T, std::string>)
      value = columns_[column_++].texts[at_];
    else
      set_value(value, columns_[column_++].numbers[at_]);
  }

 private:
  static constexpr std::size_t kFinding = ~std::size_t{0};
  struct Column {
    std::vector<std::uint64_t> numbers;
    std::vector<std::string_view> texts;
    [[nodiscard]] std::size_t size() const { return numbers.size() + texts.size(); }
  };
  void find(int number, const char* name, bool are_texts, bool are_doubles);
  const WireFields& fields_;
  int offset_;
  std::size_t at_most_;
  std::vector<Column> columns_;
  std::size_t column_ = kFinding, at_ = 0;
  Status status_;
};

}  // namespace tutti::wire
