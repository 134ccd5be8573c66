// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

/// GTSAM's symbol keys: a letter and a number in one id, letter << 56 | number.
namespace tutti::formats {

inline constexpr int kSymbolShift = 56;

/// The letter in an id; nothing where it is a plain number.
std::optional<char> letter_of(std::int64_t id);
/// "b12" of a symbol key, "12" of a plain number.
std::string vertex_name(std::int64_t id);

}  // namespace tutti::formats
