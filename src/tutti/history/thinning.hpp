// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// Which values of the past are kept: the older, the fewer.
namespace tutti::history {

/// Time between two values that are kept of one key: the largest power of two, in ms, that is at most `age_ms` /
/// `per_age`. 0: all are kept, as with a `per_age` of 0.
std::int64_t spacing_ms(std::int64_t age_ms, std::uint32_t per_age);

/// Places of the times that are not kept. Time is divided into intervals of spacing_ms(), of which each keeps its last
/// value: what holds at an interval's end, and after it, is what held then. The first time is kept, and so is the last.
/// At most 2 `per_age` + 1 are left of those that are between one age and twice as old. To thin what was thinned before
/// leaves no longer gaps than to thin all of it at once. `times_ms` ascends, and ends at `now_ms` or before.
std::vector<std::size_t> surplus(std::span<const std::int64_t> times_ms, std::int64_t now_ms, std::uint32_t per_age);

}  // namespace tutti::history
