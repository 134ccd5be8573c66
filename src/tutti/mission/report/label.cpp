// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/label.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>

namespace tutti::mission {
namespace {

constexpr int kLetterColumns = 5;
constexpr int kRows = 7;

struct Letter {
  char character;
  std::array<std::uint8_t, kRows> rows;  // from above; the highest of five bits is the left column
};

/// As many as the names and scale bars of the pictures need.
constexpr Letter kLetters[] = {
    // clang-format off
    {'a', {0b00000, 0b00000, 0b01110, 0b00001, 0b01111, 0b10001, 0b01111}},
    {'b', {0b10000, 0b10000, 0b11110, 0b10001, 0b10001, 0b10001, 0b11110}},
    {'c', {0b00000, 0b00000, 0b01110, 0b10000, 0b10000, 0b10001, 0b01110}},
    {'d', {0b00001, 0b00001, 0b01111, 0b10001, 0b10001, 0b10001, 0b01111}},
    {'e', {0b00000, 0b00000, 0b01110, 0b10001, 0b11111, 0b10000, 0b01110}},
    {'i', {0b00100, 0b00000, 0b01100, 0b00100, 0b00100, 0b00100, 0b01110}},
    {'m', {0b00000, 0b00000, 0b11010, 0b10101, 0b10101, 0b10101, 0b10101}},
    {'n', {0b00000, 0b00000, 0b11110, 0b10001, 0b10001, 0b10001, 0b10001}},
    {'o', {0b00000, 0b00000, 0b01110, 0b10001, 0b10001, 0b10001, 0b01110}},
    {'r', {0b00000, 0b00000, 0b10110, 0b11001, 0b10000, 0b10000, 0b10000}},
    {'s', {0b00000, 0b00000, 0b01111, 0b10000, 0b01110, 0b00001, 0b11110}},
    {'t', {0b01000, 0b01000, 0b11110, 0b01000, 0b01000, 0b01001, 0b00110}},
    {'u', {0b00000, 0b00000, 0b10001, 0b10001, 0b10001, 0b10001, 0b01111}},
    {'v', {0b00000, 0b00000, 0b10001, 0b10001, 0b10001, 0b01010, 0b00100}},
    {'y', {0b00000, 0b00000, 0b10001, 0b10001, 0b01111, 0b00001, 0b01110}},
    {'0', {0b01110, 0b10001, 0b10011, 0b10101, 0b11001, 0b10001, 0b01110}},
    {'1', {0b00100, 0b01100, 0b00100, 0b00100, 0b00100, 0b00100, 0b01110}},
    {'2', {0b01110, 0b10001, 0b00001, 0b00110, 0b01000, 0b10000, 0b11111}},
    {'5', {0b11111, 0b10000, 0b11110, 0b00001, 0b00001, 0b10001, 0b01110}},
    {'.', {0b00000, 0b00000, 0b00000, 0b00000, 0b00000, 0b01100, 0b01100}},
    // clang-format on
};

}  // namespace

void fill(RgbaImage& image, int left, int top, int width, int height, formats::Rgb colour) {
  for (int y = std::max(top, 0); y < std::min(top + height, static_cast<int>(image.height)); ++y)
    for (int x = std::max(left, 0); x < std::min(left + width, static_cast<int>(image.width)); ++x) {
      std::uint8_t* pixel = &image.rgba[4 * (static_cast<std::size_t>(y) * image.width + static_cast<std::size_t>(x))];
      pixel[0] = colour.red;
      pixel[1] = colour.green;
      pixel[2] = colour.blue;
      pixel[3] = 255;
    }
}

void draw_label(RgbaImage& image, int left, int top, std::string_view text, int square, formats::Rgb colour) {
  for (const char character : text) {
    const auto* letter = std::find_if(std::begin(kLetters), std::end(kLetters),
                                      [&](const Letter& l) { return l.character == character; });
    for (int row = 0; letter != std::end(kLetters) && row < kRows; ++row)
      for (int column = 0; column < kLetterColumns; ++column)
        if ((letter->rows[static_cast<std::size_t>(row)] >> (kLetterColumns - 1 - column) & 1) != 0)
          fill(image, left + column * square, top + row * square, square, square, colour);
    left += (kLetterColumns + 1) * square;
  }
}

}  // namespace tutti::mission
