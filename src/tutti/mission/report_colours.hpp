// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "tutti/formats/ply.hpp"

/// The robots' colours, in the order of the record, repeating after 8: of the page's strokes, map.ply and pictures.
namespace tutti::mission {

inline constexpr std::size_t kRobotColours = 8;
formats::Rgb robot_rgb(std::size_t index);
formats::Rgb robot_rgb_on_dark(std::size_t index);

}  // namespace tutti::mission
