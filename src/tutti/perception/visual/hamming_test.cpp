// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/hamming.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <bitset>

#include "support/perception/visual/descriptors.hpp"
#include "tutti/base/random.hpp"

namespace tutti::visual {
namespace hamming_test {

using test::random_rows;

RC_GTEST_PROP(Hamming, countsTheBitsThatDiffer, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const auto words = *rc::gen::inRange<std::uint32_t>(1, 10);  // compiled ones, and others
  const Descriptors rows = random_rows(words, 20, rng);
  const Descriptors query = random_rows(words, 1, rng);
  std::vector<std::uint32_t> distances(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::size_t expected = 0;
    for (std::uint32_t w = 0; w < words; ++w)
      expected += std::bitset<64>(query.row(0)[w]).count() + std::bitset<64>(rows.row(i)[w]).count() -
                  2 * std::bitset<64>(query.row(0)[w] & rows.row(i)[w]).count();
    RC_ASSERT(hamming_distance(query.row(0), rows.row(i)) == expected);
    distances[i] = static_cast<std::uint32_t>(expected);
  }
  const auto most = *rc::gen::inRange<std::uint32_t>(0, 64 * words);
  std::vector<NearRow> near;
  rows_within(query.row(0), rows, most, near);
  auto next = near.begin();
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    if (distances[i] > most) continue;
    RC_ASSERT(next != near.end() && next->row == i && next->distance == distances[i]);
    ++next;
  }
  RC_ASSERT(next == near.end());
  const auto which = *rc::gen::container<std::vector<std::uint32_t>>(rc::gen::inRange(0U, 20U));
  std::uint32_t least = kNoDistance;
  for (const std::uint32_t i : which) least = std::min(least, distances[i]);
  RC_ASSERT(least_distance(query.row(0), rows, which) == least);
}

}  // namespace hamming_test
}  // namespace tutti::visual
