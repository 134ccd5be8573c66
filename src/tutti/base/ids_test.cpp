// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/ids.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <type_traits>
#include <unordered_set>

namespace tutti {
namespace ids_test {

// Mixing kinds of ids up must not compile.
static_assert(!std::is_convertible_v<std::uint32_t, RobotId>);
static_assert(!std::is_convertible_v<KeyframeId, SubmapId>);
static_assert(!std::is_convertible_v<SubmapId, KeyframeId>);

template <class Id>
class PairId : public ::testing::Test {};
using PairIds = ::testing::Types<KeyframeId, SubmapId>;
TYPED_TEST_SUITE(PairId, PairIds);

TYPED_TEST(PairId, OrdersByRobotThenSessionThenIndex) {
  const TypeParam a{RobotId{1}, 9};
  const TypeParam b{{RobotId{1}, 1}, 0};
  const TypeParam c{RobotId{2}, 0};
  const TypeParam d{RobotId{2}, 1};
  EXPECT_LT(a, b);
  EXPECT_LT(b, c);
  EXPECT_LT(c, d);
  EXPECT_EQ(a, (TypeParam{{RobotId{1}, 0}, 9}));
}

TYPED_TEST(PairId, HashTellsEveryOneApart) {
  constexpr std::uint32_t kMax = std::numeric_limits<std::uint32_t>::max();
  constexpr std::uint64_t kLast = 1'700'000'000'123'456'789;
  std::unordered_set<std::size_t> hashes;
  for (const std::uint32_t robot : {0U, 1U, 2U, kMax})
    for (const std::uint32_t index : {0U, 1U, 2U, kMax})
      for (const std::uint64_t session : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{1'700'000'000}, kLast})
        hashes.insert(std::hash<TypeParam>{}(TypeParam{{RobotId{robot}, session}, index}));
  EXPECT_EQ(hashes.size(), 64U);
}

TEST(ChainId, IsCalledByItsRobotAloneInTheFirstSession) {
  EXPECT_EQ(to_string(SubmapId{RobotId{3}, 17}), "3/17");
  EXPECT_EQ(to_string(SubmapId{{RobotId{3}, 5}, 17}), "3:5/17");
}

}  // namespace ids_test
}  // namespace tutti
