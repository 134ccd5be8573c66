// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::mapfile {

/// These rows stand in the place of a row; without any it is left out.
using NewRows = std::vector<storage::Write>;
struct ChangedTable {
  const char* table;
  std::function<Result<NewRows>(std::string_view key, std::string_view bytes)> change;  ///< Asked for every row.
};
/// Copies these tables, one after the other, as they are changed.
Status copy_changed(const storage::TableStore& map, const std::vector<ChangedTable>& tables, storage::TableStore& out);

/// The refusals in a row of answers, so that nobody verifies these pairs again; those for which `change` returns true.
/// Answers that were not believed stay behind, and a row that cannot be read, as who opens the map reads it no better.
NewRows refusals_of(std::string_view bytes, const std::function<bool(ClosureVerdict&)>& change);

}  // namespace tutti::mapfile
