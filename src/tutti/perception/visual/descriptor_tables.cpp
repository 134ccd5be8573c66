// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/descriptor_tables.hpp"

#include <algorithm>
#include <numeric>

#include "tutti/base/random.hpp"
#include "tutti/perception/visual/hamming.hpp"

namespace tutti::visual {
namespace {

/// Which bits of which word make one table's key; no two of them are at one place of their words.
std::vector<std::uint64_t> masks_of(std::uint32_t words, Rng& rng) {
  std::array<std::uint32_t, 64> places{};
  std::iota(places.begin(), places.end(), 0U);
  std::vector<std::uint64_t> out(words, 0);
  for (std::size_t i = 0; i < kKeyBits; ++i) {
    std::swap(places[i], places[i + rng.index(places.size() - i)]);
    out[rng.index(words)] |= std::uint64_t{1} << places[i];
  }
  return out;
}

std::uint16_t key_of(std::span<const std::uint64_t> row, const std::vector<std::uint64_t>& masks) {
  std::uint64_t chosen = 0;
  for (std::size_t w = 0; w < row.size(); ++w) chosen |= row[w] & masks[w];
  constexpr std::uint64_t kGoldenRatio = 0x9E3779B97F4A7C15ULL;  // its product brings all chosen bits to the top
  return static_cast<std::uint16_t>((chosen * kGoldenRatio) >> (64 - kKeyBits));
}

}  // namespace

std::vector<TableKeys> table_keys(const Descriptors& rows) {
  std::vector<TableKeys> out(rows.size());
  if (out.empty()) return out;
  Rng rng(rows.words);
  for (std::size_t t = 0; t < kTables; ++t) {
    const auto masks = masks_of(rows.words, rng);
    for (std::size_t i = 0; i < out.size(); ++i) out[i][t] = key_of(rows.row(i), masks);
  }
  return out;
}

DescriptorTables::DescriptorTables(std::span<const TableKeys> rows) {
  constexpr std::size_t kWords = (std::size_t{1} << kKeyBits) / 64;
  std::vector<std::uint32_t> by_key(rows.size());
  for (std::size_t t = 0; t < kTables; ++t) {
    std::iota(by_key.begin(), by_key.end(), 0U);
    std::ranges::stable_sort(by_key, {}, [&](std::uint32_t row) { return rows[row][t]; });
    Table& table = tables_[t];
    table.taken.assign(kWords, 0);
    table.first.assign(kWords + 1, 0);
    for (const std::uint32_t row : by_key) {
      const std::uint32_t key = rows[row][t];
      table.taken[key / 64] |= std::uint64_t{1} << (key % 64);
      ++table.first[key / 64 + 1];
      table.entries.push_back(64 * row + key % 64);
    }
    std::partial_sum(table.first.begin(), table.first.end(), table.first.begin());
  }
}

template <class F>
bool DescriptorTables::any(const TableKeys& keys, const F& is_enough) const {
  for (std::size_t t = 0; t < kTables; ++t) {
    const Table& table = tables_[t];
    const std::uint32_t word = keys[t] / 64U, bit = keys[t] % 64U;
    if (table.taken.empty() || ((table.taken[word] >> bit) & 1U) == 0) continue;
    for (std::uint32_t i = table.first[word]; i < table.first[word + 1]; ++i)
      if (const std::uint32_t entry = table.entries[i]; entry % 64 == bit && is_enough(entry / 64)) return true;
  }
  return false;
}

bool DescriptorTables::has_near(std::span<const std::uint64_t> query, const TableKeys& keys, const Descriptors& rows,
                                std::uint32_t most) const {
  return any(keys, [&](std::uint32_t row) { return hamming_distance(query, rows.row(row)) <= most; });
}

bool DescriptorTables::mark_near(std::span<const std::uint64_t> query, const TableKeys& keys, const Descriptors& rows,
                                 std::uint32_t most, std::vector<bool>& near) const {
  bool found = false;
  any(keys, [&](std::uint32_t row) {
    if (hamming_distance(query, rows.row(row)) <= most) near[row] = found = true;
    return false;
  });
  return found;
}

std::size_t DescriptorTables::bytes() const {
  std::size_t out = 0;
  for (const Table& table : tables_)
    out += 8 * table.taken.capacity() + 4 * (table.first.capacity() + table.entries.capacity());
  return out;
}

}  // namespace tutti::visual
