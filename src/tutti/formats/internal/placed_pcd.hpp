// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "tutti/formats/ply.hpp"

namespace tutti::formats::internal {

/// The points of a PCD file (pcd.hpp), from an origin near them on.
Result<PlacedCloud> parse_placed_pcd(std::string_view bytes, const std::string& name);

}  // namespace tutti::formats::internal
