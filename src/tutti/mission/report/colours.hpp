// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

#include "tutti/formats/ply.hpp"

/// The robots' colours on the page, in map.ply and in pictures: by position in the record, repeating after
/// kRobotColours.
namespace tutti::mission {

inline constexpr std::size_t kRobotColours = 8;
formats::Rgb robot_rgb(std::size_t index);
formats::Rgb robot_rgb_on_dark(std::size_t index);

/// Such as "#0f6fb5".
std::string hex(formats::Rgb colour);

}  // namespace tutti::mission
