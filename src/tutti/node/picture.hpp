// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string_view>

#include "tutti/base/result.hpp"

namespace tutti::node {

/// Whether a mark may have this picture: a JPEG or PNG file whose header has at most kMostPixels. A small file may
/// claim so many that whoever shows it runs out of memory: a browser takes four bytes for each.
Status check_picture(std::string_view bytes);
inline constexpr std::uint64_t kMostPixels = 50'000'000;  // 200 MB

}  // namespace tutti::node
