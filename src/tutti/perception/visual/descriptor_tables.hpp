// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tutti/model/visual.hpp"

namespace tutti::visual {

/// More tables find more near descriptors at proportional cost; with more bits fewer rows share a key.
inline constexpr std::size_t kTables = 6, kKeyBits = 16;

/// The keys of one descriptor, one for every table.
using TableKeys = std::array<std::uint16_t, kTables>;

/// The keys of every row: for every table some of its bits, chosen by the number of words alone.
std::vector<TableKeys> table_keys(const Descriptors& rows);

/// Locality-sensitive hashing of descriptors (Indyk and Motwani 1998), to find near ones without comparing with all:
/// near descriptors most likely have all bits of a key in common in some table.
class DescriptorTables {
 public:
  DescriptorTables() = default;
  explicit DescriptorTables(std::span<const TableKeys> rows);

  /// True if some row that shares a key with the query is within `most` bits of it; near rows that share no key are
  /// missed. `rows`: the descriptors that the tables were made of.
  [[nodiscard]] bool has_near(std::span<const std::uint64_t> query, const TableKeys& keys, const Descriptors& rows,
                              std::uint32_t most) const;
  /// Marks, in `near` (one per row), the rows that share a key with the query and are within `most` bits of it; true if
  /// there are any.
  bool mark_near(std::span<const std::uint64_t> query, const TableKeys& keys, const Descriptors& rows,
                 std::uint32_t most, std::vector<bool>& near) const;
  [[nodiscard]] std::size_t bytes() const;  ///< Memory used beside the object itself.

 private:
  struct Table {
    std::vector<std::uint64_t> taken;    // a bit for every key: few are taken, so most queries end here
    std::vector<std::uint32_t> first;    // of each word of `taken` its first entry; and the end
    std::vector<std::uint32_t> entries;  // by key: 64 times the row, and which bit of its word the key is
  };
  /// Calls is_enough(row) for rows that share a key with the query, some more than once, until it returns true.
  template <class F>
  bool any(const TableKeys& keys, const F& is_enough) const;
  std::array<Table, kTables> tables_;
};

}  // namespace tutti::visual
