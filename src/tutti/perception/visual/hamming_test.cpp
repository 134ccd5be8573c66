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
  std::vector<std::uint16_t> distances(rows.size());
  hamming_distances(query.row(0), rows, distances);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::size_t expected = 0;
    for (std::uint32_t w = 0; w < words; ++w)
      expected += std::bitset<64>(query.row(0)[w]).count() + std::bitset<64>(rows.row(i)[w]).count() -
                  2 * std::bitset<64>(query.row(0)[w] & rows.row(i)[w]).count();
    RC_ASSERT(distances[i] == expected);
    RC_ASSERT(hamming_distance(query.row(0), rows.row(i)) == expected);
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
  for (const std::uint32_t i : which) least = std::min<std::uint32_t>(least, distances[i]);
  RC_ASSERT(least_distance(query.row(0), rows, which) == least);
}

RC_GTEST_PROP(TwoNearest, isTheSmallestAndTheSmallestOfAnotherGroup, ()) {
  const auto distances = *rc::gen::container<std::vector<std::uint16_t>>(rc::gen::inRange<std::uint16_t>(0, 12));
  const auto groups = *rc::gen::container<std::vector<std::uint32_t>>(distances.size(), rc::gen::inRange(0U, 4U));
  const TwoNearest found = two_nearest(distances, groups);
  const auto best = std::ranges::min_element(distances);
  RC_ASSERT((found.nearest == kNoIndex) == distances.empty());
  if (distances.empty()) return;
  RC_ASSERT(found.nearest == static_cast<std::uint32_t>(best - distances.begin()));
  RC_ASSERT(found.distance == *best);
  std::uint32_t second = kNoDistance;
  for (std::size_t i = 0; i < distances.size(); ++i)
    if (groups[i] != groups[found.nearest]) second = std::min<std::uint32_t>(second, distances[i]);
  RC_ASSERT(found.second_distance == second);
}

TEST(TwoNearest, withoutGroupsEveryRowIsARival) {
  const std::vector<std::uint16_t> distances{5, 3, 3};
  const TwoNearest found = two_nearest(distances);
  EXPECT_EQ(found.nearest, 1U);
  EXPECT_EQ(found.second, 2U);
  EXPECT_EQ(found.second_distance, 3U);
}

}  // namespace hamming_test
}  // namespace tutti::visual
