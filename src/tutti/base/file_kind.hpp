// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"

namespace tutti {

/// The use that somebody gives a file for.
enum class FileUse { recording, trajectory, graph, map };

/// So much of a file says what it is; tables of SQLite have their names in its first pages.
inline constexpr std::size_t kHeadBytes = std::size_t{1} << 16;

/// Says of a file that is known to be of no use for this what it is, and what to type, after "PATH: "; empty for all
/// others. `head`: its first kHeadBytes, or all of it.
std::string known_otherwise(std::string_view head, const std::string& path, FileUse use);

/// read_file(), but for what is known to be of no use for this.
Result<std::string> read_file_for(FileUse use, const std::string& path);

}  // namespace tutti
