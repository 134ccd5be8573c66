// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "tutti/base/random.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::visual::test {

inline Descriptors random_rows(std::uint32_t words, std::size_t n, Rng& rng) {
  Descriptors rows{.kind = DescriptorKind::orb, .words = words};
  for (std::size_t i = 0; i < n * words; ++i) rows.bits.push_back(rng.index(~std::uint64_t{0}));
  return rows;
}

}  // namespace tutti::visual::test
