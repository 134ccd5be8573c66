// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace tutti::bags::internal {

/// SHA-256 (FIPS 180-4) in 64 hexadecimal digits. For names, not for secrets.
std::string sha256(std::string_view bytes);

}  // namespace tutti::bags::internal
