// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string_view>

#include "tutti/formats/ply.hpp"
#include "tutti/mission/report/png.hpp"

namespace tutti::mission {

/// Fills a rectangle; parts outside the image are cut off.
void fill(RgbaImage& image, int left, int top, int width, int height, formats::Rgb colour);

/// Writes lower-case words and numbers on an image, in a typeface of 5 x 7 squares that are `square` pixels wide.
/// Unknown characters stay blank; parts outside the image are cut off.
void draw_label(RgbaImage& image, int left, int top, std::string_view text, int square, formats::Rgb colour);

}  // namespace tutti::mission
