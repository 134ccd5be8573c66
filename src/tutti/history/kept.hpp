// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace tutti::history {

/// How much is kept of one kind of message.
struct Kept {
  std::string_view kind;
  std::uint32_t per_age = 0;      ///< As of spacing_ms(); 0: every value.
  std::uint64_t most_bytes = 0;   ///< Its keys and values have so many at most; beyond, the past becomes coarser.
  std::uint32_t most_values = 0;  ///< One answer has so many of one key.
  std::uint64_t most_sent = 0;    ///< Bytes of the values, as text, in one answer.
};

inline constexpr std::uint64_t kMegabyte = 1'000'000;
/// All that a mission's past consists of. What else the page is sent, such as who inspects what, is of no use later.
inline constexpr std::array kKept{
    Kept{"status", 100, 30 * kMegabyte, 200, 4 * kMegabyte},
    Kept{"radio", 30, 5 * kMegabyte, 30, kMegabyte / 2},
    Kept{"poses", 100, 50 * kMegabyte, 200, 5 * kMegabyte},
    Kept{"alerts", 0, 10 * kMegabyte, 200, kMegabyte},
    Kept{"disagreement", 20, 10 * kMegabyte, 10, kMegabyte / 2},
    Kept{"submap", 0, 20 * kMegabyte, 2, kMegabyte / 2},
    Kept{"closure", 0, 15 * kMegabyte, 8, kMegabyte},
    Kept{"mark", 0, 3 * kMegabyte, 8, kMegabyte / 4},
    Kept{"acknowledged", 0, 2 * kMegabyte, 8, kMegabyte / 4},
};
/// Bytes that the file never exceeds: pages of small rows are filled to two thirds.
inline constexpr std::uint64_t kMostFile = 195 * kMegabyte;

}  // namespace tutti::history
