// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tutti/model/visual.hpp"

namespace tutti::visual {

/// Number of bits in which two descriptors of as many words (checked) differ. This and the next two functions use the
/// processor's popcnt where it has one, which is found out when the program runs.
std::uint32_t hamming_distance(std::span<const std::uint64_t> a, std::span<const std::uint64_t> b);

/// The distance, in bits, that is this share of a row's.
inline std::uint32_t distance_of_share(double share, const Descriptors& rows) {
  return static_cast<std::uint32_t>(share * 64.0 * rows.words);
}

inline constexpr std::uint32_t kNoDistance = 0xFFFF;  ///< More bits than any descriptor has.

/// Least distance of `query` to the rows `which` (valid indices); kNoDistance without any.
std::uint32_t least_distance(std::span<const std::uint64_t> query, const Descriptors& rows,
                             std::span<const std::uint32_t> which);

/// Index of a row and its distance, bits.
struct NearRow {
  std::uint32_t row = 0;
  std::uint32_t distance = 0;
};

/// Replaces `out` by the rows within `most` bits of `query`, by increasing index.
void rows_within(std::span<const std::uint64_t> query, const Descriptors& rows, std::uint32_t most,
                 std::vector<NearRow>& out);

}  // namespace tutti::visual
