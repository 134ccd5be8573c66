// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/ids.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <type_traits>
#include <unordered_set>

namespace tutti {
namespace {

// Mixing kinds of ids up must not compile.
static_assert(!std::is_convertible_v<std::uint32_t, RobotId>);
static_assert(!std::is_convertible_v<KeyframeId, SubmapId>);
static_assert(!std::is_convertible_v<SubmapId, KeyframeId>);

template <class Id>
class PairId : public ::testing::Test {};
using PairIds = ::testing::Types<KeyframeId, SubmapId>;
TYPED_TEST_SUITE(PairId, PairIds);

TYPED_TEST(PairId, OrdersByRobotThenIndex) {
  const TypeParam a{.robot = {1}, .index = 9};
  const TypeParam b{.robot = {2}, .index = 0};
  const TypeParam c{.robot = {2}, .index = 1};
  EXPECT_LT(a, b);
  EXPECT_LT(b, c);
  EXPECT_EQ(a, (TypeParam{.robot = {1}, .index = 9}));
}

TYPED_TEST(PairId, HashTellsEveryPairApart) {
  constexpr std::uint32_t kMax = std::numeric_limits<std::uint32_t>::max();
  std::unordered_set<std::size_t> hashes;
  for (const std::uint32_t robot : {0U, 1U, 2U, kMax})
    for (const std::uint32_t index : {0U, 1U, 2U, kMax})
      hashes.insert(std::hash<TypeParam>{}(TypeParam{.robot = {robot}, .index = index}));
  EXPECT_EQ(hashes.size(), 16U);
}

}  // namespace
}  // namespace tutti
