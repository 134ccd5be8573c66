// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"

/// Texts of numbers as other programs and countries write them.
namespace tutti::formats::internal {

/// Without quotes round its columns, and with decimal points where it has decimal commas: columns are then separated
/// by semicolons or blanks. UTF-16 is an error with the command that makes UTF-8 of it.
Result<std::string> plain_text(std::string text, const std::string& name);

/// Says what a text that is no trajectory is, and what to type; empty when it is nothing that is known.
std::string otherwise_known(std::string_view text);

}  // namespace tutti::formats::internal
