// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/symbol_keys.hpp"

#include <fmt/core.h>

namespace tutti::formats {

std::optional<char> letter_of(std::int64_t id) {
  const auto letter = static_cast<char>(id >> kSymbolShift);
  const bool is_letter = (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z');
  return id > 0 && is_letter ? std::optional(letter) : std::nullopt;
}

std::string vertex_name(std::int64_t id) {
  const auto letter = letter_of(id);
  return letter ? fmt::format("{}{}", *letter, id & ((std::int64_t{1} << kSymbolShift) - 1)) : fmt::format("{}", id);
}

}  // namespace tutti::formats
