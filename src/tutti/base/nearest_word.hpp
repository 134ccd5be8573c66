// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace tutti {

/// The word of `known` that differs from a misspelt one in the fewest letters (Levenshtein's distance), if these are at
/// most two, or half of the word; of several, the first.
std::optional<std::string> nearest_word(std::string_view word, std::span<const std::string> known);

}  // namespace tutti
