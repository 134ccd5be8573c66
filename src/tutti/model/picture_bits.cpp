// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/picture_bits.hpp"

#include <algorithm>
#include <vector>

#include "tutti/base/check.hpp"

namespace tutti {
namespace {

/// The least value that more than `left_out` pixels do not exceed, by how many pixels have each value.
std::size_t value_at(const std::vector<std::uint32_t>& count, std::size_t left_out) {
  std::size_t at = 0;
  for (std::size_t seen = 0; at + 1 < count.size(); ++at)
    if (seen += count[at]; seen > left_out) break;
  return at;
}

}  // namespace

Image in_8_bits(int width_px, int height_px, std::span<const std::uint16_t> values) {
  constexpr std::size_t kValues = std::size_t{1} << 16U, kLeftOut = 1000, kMost = 255;
  Image out(width_px, height_px);
  TUTTI_CHECK(values.size() == out.grey.size(), "{} values of {} x {} pixels", values.size(), width_px, height_px);
  std::vector<std::uint32_t> count(kValues, 0);
  for (const std::uint16_t value : values) ++count[value];
  const std::size_t least = value_at(count, values.size() / kLeftOut);
  std::ranges::reverse(count);
  const std::size_t greatest = kValues - 1 - value_at(count, values.size() / kLeftOut);
  if (greatest <= least) return out;
  const std::size_t range = greatest - least;
  std::ranges::transform(values, out.grey.begin(), [&](std::uint16_t value) {
    const std::size_t above = std::clamp<std::size_t>(value, least, greatest) - least;
    return static_cast<std::uint8_t>((above * kMost + range / 2) / range);
  });
  return out;
}

}  // namespace tutti
