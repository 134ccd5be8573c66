// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

/// Tables of alternatives. A row has at least a `name` and a `help`; from the table follow lists of names, help texts,
/// checks and error sentences.
namespace tutti {

template <class Rows>
std::vector<std::string> names_of(const Rows& rows) {
  std::vector<std::string> names;
  for (const auto& row : rows) names.emplace_back(row.name);
  return names;
}

/// "NAME: HELP; NAME: HELP".
template <class Rows>
std::string help_of(const Rows& rows) {
  std::string out;
  for (const auto& row : rows) out.append(out.empty() ? "" : "; ").append(row.name).append(": ").append(row.help);
  return out;
}

/// The row of this name; null when there is none.
template <class Rows>
auto row_of(const Rows& rows, std::string_view name) -> decltype(&*rows.begin()) {
  for (const auto& row : rows)
    if (row.name == name) return &row;
  return nullptr;
}

/// "a, b or c", for what was expected.
inline std::string or_list(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < names.size(); ++i)
    out.append(i == 0 ? "" : i + 1 == names.size() ? " or " : ", ").append(names[i]);
  return out;
}

}  // namespace tutti
