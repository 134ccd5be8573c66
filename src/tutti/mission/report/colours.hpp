// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "tutti/formats/ply.hpp"

/// The robots' colours on the page and in map.ply: by position in the record, repeating after
/// kRobotColours.
namespace tutti::mission {

inline constexpr std::size_t kRobotColours = 8;
formats::Rgb robot_rgb(std::size_t index);

}  // namespace tutti::mission
