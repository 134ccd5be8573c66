// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <iosfwd>
#include <string>
#include <string_view>

#include "tutti/base/result.hpp"

namespace tutti {

/// Opens a file for reading. It must be a regular one, because a pipe may never be written to and a device never end.
/// Errors (ErrorCode::io) name the file and why.
Result<std::ifstream> open_file(const std::string& path);

/// Reads a whole file of at most so many bytes, which open_file() opens, or writes one in place of what stood there.
/// Errors (ErrorCode::io) name the file and why. write_file() is not atomic.
Result<std::string> read_file(const std::string& path, std::size_t most_bytes = std::size_t{4} << 30);
Status write_file(const std::string& path, std::string_view bytes);

}  // namespace tutti
