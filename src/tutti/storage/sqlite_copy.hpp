// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "tutti/base/result.hpp"

namespace tutti::storage {

/// Copies a store's file to `to`, with its FILE-wal, while another process may have it open and commit to it: the copy
/// has what was committed at some time during the call. It only reads, takes no locks, and leaves `from` as it is.
///
/// This process must not have the store open: closing a file ends all locks that a process has on it. Errors: there is
/// no such file, it is just being made, it cannot be read, `to` cannot be written, or commits came faster than copies.
/// After an error `to` may be there in part.
Status copy_sqlite_store(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace tutti::storage
