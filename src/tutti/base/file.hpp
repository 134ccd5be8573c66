// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/base/result.hpp"

namespace tutti {

/// Reads a whole file, or writes one in place of what stood there. Errors (ErrorCode::io) name the file and why.
/// write_file() is not atomic.
Result<std::string> read_file(const std::string& path);
Status write_file(const std::string& path, std::string_view bytes);

}  // namespace tutti
