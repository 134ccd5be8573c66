// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/descriptor_tables.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include "support/perception/visual/descriptors.hpp"
#include "tutti/base/random.hpp"
#include "tutti/perception/visual/hamming.hpp"

namespace tutti::visual {
namespace descriptor_tables_test {

using test::random_rows;

/// The rows again, each with this share of its bits turned.
Descriptors turned(Descriptors rows, double share, Rng& rng) {
  for (std::uint64_t& word : rows.bits)
    for (int bit = 0; bit < 64; ++bit) word ^= static_cast<std::uint64_t>(rng.bernoulli(share)) << bit;
  return rows;
}

std::size_t count(const Descriptors& queries, const Descriptors& rows, std::uint32_t most) {
  const DescriptorTables tables(table_keys(rows));
  const auto keys = table_keys(queries);
  std::size_t out = 0;
  for (std::size_t i = 0; i < queries.size(); ++i) out += tables.has_near(queries.row(i), keys[i], rows, most);
  return out;
}

TEST(DescriptorTables, findMostOfWhatIsNear) {
  for (const std::uint32_t words : {1U, 4U, 6U, 8U}) {
    Rng rng(words);
    const Descriptors rows = random_rows(words, 1000, rng);
    const auto most = static_cast<std::uint32_t>(0.16 * 64.0 * words);
    EXPECT_EQ(count(rows, rows, 0), 1000U);
    EXPECT_GT(count(turned(rows, 0.03, rng), rows, most), 950U);
    EXPECT_GT(count(turned(rows, 0.08, rng), rows, most), 700U);
  }
}

TEST(DescriptorTables, findNothingElse) {
  Rng rng(1);
  const Descriptors rows = random_rows(6, 3000, rng), others = random_rows(6, 500, rng);
  EXPECT_EQ(count(others, rows, 61), 0U);
  const Descriptors alike = turned(rows, 0.08, rng);
  const auto keys = table_keys(alike);
  const DescriptorTables tables(table_keys(rows));
  std::vector<std::uint32_t> all(rows.size());
  std::iota(all.begin(), all.end(), 0U);
  for (std::size_t i = 0; i < 300; ++i) {
    const std::uint32_t nearest = least_distance(alike.row(i), rows, all);
    EXPECT_FALSE(tables.has_near(alike.row(i), keys[i], rows, nearest - 1));
  }
}

TEST(DescriptorTables, ofNothingFindNothing) {
  Rng rng(1);
  const Descriptors queries = random_rows(6, 10, rng), none{.kind = DescriptorKind::orb, .words = 6};
  EXPECT_EQ(count(queries, none, 384), 0U);
  EXPECT_FALSE(DescriptorTables().has_near(queries.row(0), table_keys(queries)[0], none, 384));
}

}  // namespace descriptor_tables_test
}  // namespace tutti::visual
