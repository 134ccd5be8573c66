// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tutti/model/visual.hpp"

namespace tutti::visual {

/// More tables find more of the descriptors that differ, and cost as much more; with more bits fewer rows share a key.
inline constexpr std::size_t kTables = 6, kKeyBits = 16;

/// Of one descriptor, a key for every table.
using TableKeys = std::array<std::uint16_t, kTables>;

/// Keys of every row: some of its bits, for every table others. Which ones depends on the number of words alone.
std::vector<TableKeys> table_keys(const Descriptors& rows);

/// Which of a set of descriptors are near another one, found without looking at all: near descriptors have all bits of
/// a key in common in one table or another, most likely (Indyk and Motwani 1998).
class DescriptorTables {
 public:
  DescriptorTables() = default;
  explicit DescriptorTables(std::span<const TableKeys> rows);

  /// Is one of the rows with a key of the query's within `most` bits of it? `rows` are those that the keys are of.
  [[nodiscard]] bool has_near(std::span<const std::uint64_t> query, const TableKeys& keys, const Descriptors& rows,
                              std::uint32_t most) const;
  [[nodiscard]] std::size_t bytes() const;  ///< Held, beside itself.

 private:
  struct Table {
    std::vector<std::uint64_t> taken;    // a bit for every key: few are, and most questions end here
    std::vector<std::uint32_t> first;    // of each word of these, its first entry; and the end
    std::vector<std::uint32_t> entries;  // by key: 64 times the row, and which bit of its word the key is
  };
  std::array<Table, kTables> tables_;
};

}  // namespace tutti::visual
