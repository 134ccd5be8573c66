// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

namespace tutti::test {

/// Path inside the folder of real recordings and golden values beside the checkout (CMake's TUTTI_SHARED_DIR).
std::filesystem::path shared_path(const std::string& relative);

/// Path inside this checkout.
std::filesystem::path source_path(const std::string& relative);

}  // namespace tutti::test
