// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"

namespace tutti::history {

inline constexpr std::size_t kMostValue = std::size_t{64} << 20U;  ///< Bytes of a value, as text.

/// A value as it is stored: as it is, or by zstd where that is shorter.
std::string packed(std::string_view value);
/// Errors: not of packed(), or of more than kMostValue bytes.
Result<std::string> unpacked(std::string_view bytes);

}  // namespace tutti::history
