// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>

#include "tutti/model/image.hpp"

namespace tutti {

/// A picture of 16 bits a pixel in 8: the least of its values becomes 0 and the greatest 255, but for a thousandth of
/// the pixels at either end. How many of the 16 bits a camera fills (10, 12, 14) is in no message.
Image in_8_bits(int width_px, int height_px, std::span<const std::uint16_t> values);

}  // namespace tutti
