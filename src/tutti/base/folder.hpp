// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "tutti/base/result.hpp"

namespace tutti {

/// Makes a folder and those above it, where they are missing. Errors (ErrorCode::io) name the folder and why.
Status make_folder(const std::filesystem::path& folder);
/// Makes the folder that a file will be in.
Status make_folder_of(const std::filesystem::path& file);

}  // namespace tutti
