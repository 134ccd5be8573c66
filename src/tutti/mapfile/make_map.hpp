// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <vector>

#include "tutti/storage/table_store.hpp"

namespace tutti::mapfile {

/// A new map that `fill` writes into. `out` must not be there; it appears whole or, on an error, not at all.
Status make_map(const std::filesystem::path& out, const std::function<Status(storage::TableStore&)>& fill);
/// One that has all rows of another store.
Status copy_map(const storage::TableStore& from, const std::filesystem::path& out);
/// So that nothing is left of it when a program ends in between: the name of a file that is being made beside `out`.
std::filesystem::path part_of(const std::filesystem::path& out);
void remove_store(const std::filesystem::path& file);

/// Commits rows in portions, so that a large map does not have to fit into memory.
class Writer {
 public:
  explicit Writer(storage::TableStore& out) : out_(out) {}
  Status put(storage::Write write);
  Status flush();

 private:
  static constexpr std::size_t kPortion = 16U << 20U;
  storage::TableStore& out_;
  std::vector<storage::Write> writes_;
  std::size_t bytes_ = 0;
};

}  // namespace tutti::mapfile
