// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string_view>

#include "tutti/base/result.hpp"
#include "tutti/program/field_json.hpp"

namespace tutti::page {

constexpr std::size_t kMostNested = 32;        ///< Arrays and objects in each other.
constexpr std::size_t kMostSeparators = 4096;  ///< Commas and colons: about as many values.

/// The JSON object of a request's body; of an empty one an empty object. Nothing is stored of a text that is nested too
/// deep or has too many values: its brackets and separators are counted first.
Result<nlohmann::ordered_json> posted_json(std::string_view body);

}  // namespace tutti::page
