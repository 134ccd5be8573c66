// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "tutti/storage/table_store.hpp"

/// Mends the parts of a damaged file without which SQLite reads nothing else of it.
namespace tutti::storage::internal {

/// Takes the size in the file's header away, so that SQLite reads the file's own, and makes the file longer by
/// what may have been cut off, as zeros that take no disk: SQLite reads nothing of a file that is shorter than its
/// header states, or whose tables begin behind its end. The file is changed.
Status forget_size(const std::filesystem::path& file);

/// Replaces the file's first page by that of an empty store: SQLite puts a new store's tables to the same pages always.
/// The file is changed. Fails when it has no page to be replaced, or pages of another size.
Status replace_first_page(const std::filesystem::path& file, const Schema& schema);

}  // namespace tutti::storage::internal
