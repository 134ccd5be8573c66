// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tutti/base/fields.hpp"

namespace tutti {

/// A value's scalar fields as texts for people: "name", "text". Those of structs inside stand where these do; lists,
/// poses and optionals without a value are left out. `columns_only`: just those with a FieldRule::column, under that
/// heading and with an empty text if there is no value.
class FieldTexts {
 public:
  explicit FieldTexts(bool columns_only) : columns_only_(columns_only) {}

  template <class T>
  void field(int /*number*/, const char* name, const T& value, const FieldRule& rule = {}, const char* /*help*/ = "") {
    if constexpr (HasFields<T>) {
      visit_fields(value, *this);
    } else if constexpr (IsOptionalField<T>) {
      if (value)
        field(0, name, *value, rule);
      else if (columns_only_)
        add(name, "", rule);
    } else if constexpr (std::is_same_v<T, double>) {
      add(name, fmt::format("{:.6g}", value), rule);
    } else if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>) {
      add(name, fmt::format("{}", value), rule);
    }
  }
  std::vector<std::pair<std::string, std::string>> texts;

 private:
  void add(const char* name, std::string text, const FieldRule& rule) {
    if (!columns_only_)
      texts.emplace_back(name, std::move(text));
    else if (*rule.column != '\0')
      texts.emplace_back(rule.column, std::move(text));
  }
  bool columns_only_;
};

template <HasFields T>
std::vector<std::pair<std::string, std::string>> field_texts(const T& value) {
  FieldTexts visitor(false);
  visit_fields(value, visitor);
  return std::move(visitor.texts);
}
template <HasFields T>
std::vector<std::pair<std::string, std::string>> field_columns(const T& value) {
  FieldTexts visitor(true);
  visit_fields(value, visitor);
  return std::move(visitor.texts);
}

}  // namespace tutti
