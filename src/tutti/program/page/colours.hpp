// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace tutti::page {

/// Red, green, blue.
using Colour = std::array<std::uint8_t, 3>;

inline constexpr std::size_t kRobotColours = 8;
/// The robots' colours on the page and in map.ply, in the order of their numbers, repeating: on light paper and on
/// dark. Hues keep apart under the common colour deficiencies.
inline constexpr std::array<Colour, kRobotColours> kOnLight{{{15, 111, 181},
                                                             {194, 65, 12},
                                                             {11, 143, 106},
                                                             {139, 63, 168},
                                                             {166, 124, 0},
                                                             {27, 155, 184},
                                                             {194, 57, 122},
                                                             {95, 125, 42}}};
inline constexpr std::array<Colour, kRobotColours> kOnDark{{{79, 179, 255},
                                                            {255, 138, 76},
                                                            {47, 211, 160},
                                                            {197, 139, 224},
                                                            {224, 181, 65},
                                                            {95, 211, 234},
                                                            {244, 127, 181},
                                                            {169, 200, 106}}};

}  // namespace tutti::page
