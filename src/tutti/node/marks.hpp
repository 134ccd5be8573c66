// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/model/map_mark.hpp"
#include "tutti/storage/table_store.hpp"

/// Marks in a map's store: rows `mark/NUMBER` and `photo/NUMBER` of its table `meta` (docs/storage.md). Nothing of the
/// map follows from them.
namespace tutti::node {

inline constexpr std::size_t kMostMarks = 500;  ///< In one map.

/// All marks. Rows that a newer program has written otherwise are left out. Fails when the table cannot be read.
Result<MarkSet> read_marks(const storage::TableStore& map);
/// A mark's photo; nothing when it has none.
Result<std::optional<std::string>> read_photo(const storage::TableStore& map, std::uint64_t number);

/// The writes that store the mark of an order, whose photo_type follows from its photo, or remove it; `known` are the
/// marks that the store has, and is changed likewise. Errors of code `invalid`, which name what is wrong: a picture of
/// another kind or size, words that are too long, a place that is none, too many marks, a number that another mark has,
/// or that none has.
Result<std::vector<storage::Write>> follow(const MarkOrder& order, MarkSet& known);

}  // namespace tutti::node
