// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

#include "tutti/formats/ply.hpp"

/// The robots' colours, in the order of the record, repeating after 8: of the page's strokes, map.ply and pictures.
namespace tutti::mission {

inline constexpr std::size_t kRobotColours = 8;
formats::Rgb robot_rgb(std::size_t index);
formats::Rgb robot_rgb_on_dark(std::size_t index);

/// "#0f6fb5"
std::string hex(formats::Rgb colour);

}  // namespace tutti::mission
