// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/history/thinning.hpp"

#include <algorithm>
#include <bit>

namespace tutti::history {
namespace {

/// Rounded down, also below 0.
std::int64_t interval_of(std::int64_t time_ms, std::int64_t spacing_ms) {
  const std::int64_t rest = time_ms % spacing_ms;
  return (time_ms - rest) / spacing_ms - (rest < 0 ? 1 : 0);
}

}  // namespace

std::int64_t spacing_ms(std::int64_t age_ms, std::uint32_t per_age) {
  if (per_age == 0 || age_ms < per_age) return 0;
  return static_cast<std::int64_t>(std::bit_floor(static_cast<std::uint64_t>(age_ms) / per_age));
}

std::vector<std::size_t> surplus(std::span<const std::int64_t> times_ms, std::int64_t now_ms, std::uint32_t per_age) {
  std::vector<std::size_t> out;
  for (std::size_t i = 1; i + 1 < times_ms.size(); ++i) {
    const std::int64_t spacing = spacing_ms(std::max<std::int64_t>(0, now_ms - times_ms[i]), per_age);
    if (spacing > 0 && interval_of(times_ms[i], spacing) == interval_of(times_ms[i + 1], spacing)) out.push_back(i);
  }
  return out;
}

}  // namespace tutti::history
