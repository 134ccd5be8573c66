// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::storage {

/// The purpose of a store, and its tables. A store is never opened as one of another kind or version. The version
/// is in one place of the file, where a flipped bit makes another of it, so the tables are its witness: every version
/// has a table that no earlier one has, and a file without a table that is not the schema's is not newer, whatever it
/// says.
struct Schema {
  std::string kind;                 ///< "map" or "robot", in the file and in messages.
  std::uint32_t version = 1;        ///< Raised when a table is added; one that means something else gets another name.
  std::vector<std::string> tables;  ///< Lower-case letters and underscores, each once.
  friend bool operator==(const Schema&, const Schema&) = default;
};

/// Schema of a server's store: one store is one map.
const Schema& map_schema();
/// Schema of a robot's store: what the robot needs to go on after a restart.
const Schema& robot_schema();

/// A change of one row: it gets these bytes, whether it existed or not; without bytes it is deleted, if it exists.
struct Write {
  std::string table;
  std::string key;
  std::optional<std::string> bytes;
  friend bool operator==(const Write&, const Write&) = default;
};

/// Tables of rows, each with a key and bytes of any content, also empty; of any length that the implementation stores
/// (SQLite: 256 MiB a row). Naming a table that is not in the schema is a bug of the caller. Any thread may call at any
/// time; calls exclude each other.
class TableStore {
 public:
  /// Called with key and bytes, which are valid until it returns; returns false to end the scan. It must not call the
  /// store.
  using Visit = std::function<bool(std::string_view key, std::string_view bytes)>;

  TableStore() = default;
  TableStore(const TableStore&) = delete;
  TableStore& operator=(const TableStore&) = delete;
  virtual ~TableStore() = default;

  /// Applies all writes, in their order, or, on an error, none. After success they survive whatever the store survives;
  /// after an error, such as a full disk, the store is as before and remains usable.
  virtual Status commit(std::span<const Write> writes) = 0;
  /// The bytes of a row; no value if there is no such row.
  [[nodiscard]] virtual Result<std::optional<std::string>> read(std::string_view table, std::string_view key) const = 0;
  /// Visits the rows with keys not below `from`, in the order of their keys (compared byte by byte as unsigned
  /// numbers).
  [[nodiscard]] virtual Status scan(std::string_view table, std::string_view from, const Visit& visit) const = 0;
  using VisitSize = std::function<void(std::string_view key, std::size_t size)>;
  /// Visits all keys in their order, with the number of bytes of each row, which are not read. `visit` as for scan().
  [[nodiscard]] virtual Status sizes(std::string_view table, const VisitSize& visit) const = 0;
};

/// A key that sorts as the tuple of numbers does: 8 bytes per number, most significant first.
std::string key_of(std::initializer_list<std::uint64_t> numbers);
/// The numbers of such a key; no value when it does not have the length of `count` numbers.
std::optional<std::vector<std::uint64_t>> numbers_of(std::string_view key, std::size_t count);

}  // namespace tutti::storage
