// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

/// Keys of a map's table `meta`, of which map_meta.hpp has the rows.
namespace tutti::node {

inline constexpr std::string_view kCountsKey = "counts";              ///< MapCounts
inline constexpr std::string_view kRefinementPrefix = "refinement/";  ///< refinement_key()
inline constexpr std::string_view kRefusedPrefix = "refused/";        ///< Then a robot: what is never taken of it.

}  // namespace tutti::node
