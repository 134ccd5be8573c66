// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace tutti::formats::internal {

/// Decodes LZF (liblzf, as PCL uses it): exactly `size` bytes, or nothing where `bytes` are no coding of so many.
std::optional<std::string> lzf_decode(std::string_view bytes, std::size_t size);

}  // namespace tutti::formats::internal
