// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/disjoint_sets.hpp"

#include <gtest/gtest.h>

namespace tutti {
namespace disjoint_sets_test {

TEST(DisjointSets, AreNumberedByTheirFirstMembers) {
  DisjointSets sets(7);
  EXPECT_TRUE(sets.join(5, 2));
  EXPECT_TRUE(sets.join(6, 5));
  EXPECT_FALSE(sets.join(2, 6));
  EXPECT_TRUE(sets.join(1, 4));
  EXPECT_FALSE(sets.join(3, 3));
  const auto [label, count] = sets.labels();
  EXPECT_EQ(label, (std::vector<int>{0, 1, 2, 3, 1, 2, 2}));
  EXPECT_EQ(count, 4);
  EXPECT_EQ(DisjointSets(0).labels().second, 0);
}

}  // namespace disjoint_sets_test
}  // namespace tutti
