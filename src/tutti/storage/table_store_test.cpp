// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/table_store.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <tuple>

namespace tutti::storage {
namespace table_store_test {

RC_GTEST_PROP(KeyOf, SortsAsItsNumbersAndGivesThemBack, ()) {
  using Numbers = std::tuple<std::uint64_t, std::uint64_t, std::uint64_t>;
  const auto number =
      rc::gen::oneOf(rc::gen::arbitrary<std::uint64_t>(), rc::gen::inRange<std::uint64_t>(0, 3),
                     rc::gen::inRange<std::uint64_t>(127, 130), rc::gen::inRange<std::uint64_t>(254, 258));
  const auto key = [](const Numbers& n) { return key_of({std::get<0>(n), std::get<1>(n), std::get<2>(n)}); };
  const Numbers a = *rc::gen::tuple(number, number, number);
  const Numbers b = *rc::gen::tuple(number, number, number);
  RC_ASSERT((a < b) == (key(a) < key(b)));
  const auto back = numbers_of(key(a), 3);
  RC_ASSERT(back.has_value());
  RC_ASSERT(Numbers((*back)[0], (*back)[1], (*back)[2]) == a);
}

TEST(KeyOf, OtherLengthsAreNoSuchKey) {
  const std::string key = key_of({1, 2});
  EXPECT_EQ(numbers_of(key, 2), (std::vector<std::uint64_t>{1, 2}));
  EXPECT_FALSE(numbers_of(key, 1));
  EXPECT_FALSE(numbers_of(key, 3));
  EXPECT_FALSE(numbers_of(key.substr(1), 2));
}

}  // namespace table_store_test
}  // namespace tutti::storage
