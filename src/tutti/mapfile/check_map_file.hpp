// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "tutti/base/result.hpp"

namespace tutti::mapfile {

/// Fails where there is no such file, or where it is known to be no map (a bag, a folder), with what to type.
Status check_map_file(const std::filesystem::path& file);

}  // namespace tutti::mapfile
