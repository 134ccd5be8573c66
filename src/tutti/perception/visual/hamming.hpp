// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tutti/model/visual.hpp"

namespace tutti::visual {

/// Bits in which two descriptors of as many words differ. All of these count by the processor's own instruction where
/// it has one, which is decided when the program runs.
std::uint32_t hamming_distance(std::span<const std::uint64_t> a, std::span<const std::uint64_t> b);

inline constexpr std::uint32_t kNoDistance = 0xFFFF;  ///< More than any descriptor has bits.

/// The least of these over rows by their index, which exist; kNoDistance of none.
std::uint32_t least_distance(std::span<const std::uint64_t> query, const Descriptors& rows,
                             std::span<const std::uint32_t> which);

/// A row and its distance.
struct NearRow {
  std::uint32_t row = 0;
  std::uint32_t distance = 0;
};

/// The rows within `most` bits of the query, by their index, in place of what is in `out`.
void rows_within(std::span<const std::uint64_t> query, const Descriptors& rows, std::uint32_t most,
                 std::vector<NearRow>& out);

}  // namespace tutti::visual
