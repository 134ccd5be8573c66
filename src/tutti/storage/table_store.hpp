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

/// What a store is for. A store of one kind is never opened as another, nor one of a newer version. A newer version has
/// the tables of those before, and more: an older store gets those when it is opened, empty.
struct Schema {
  std::string kind;                 ///< In messages and in the file: "map", "robot".
  std::uint32_t version = 1;        ///< Raised when tables or the meaning of their bytes change.
  std::vector<std::string> tables;  ///< Lower-case letters and underscores, each once.
  friend bool operator==(const Schema&, const Schema&) = default;
};

/// The server's: one store is one map.
const Schema& map_schema();
/// A robot's: what it needs to go on after a restart.
const Schema& robot_schema();

/// One row put in place of the one with this key, if any; nothing: the row is deleted, if it is there.
struct Write {
  std::string table;
  std::string key;
  std::optional<std::string> bytes;
  friend bool operator==(const Write&, const Write&) = default;
};

/// Tables of rows, each with a key and bytes, both of any content and length, also empty. A table that is not in the
/// schema is a bug of the caller. Any thread may call at any time; calls exclude each other.
class TableStore {
 public:
  /// Gets key and bytes, valid until it returns; false ends the scan. Must not call the store.
  using Visit = std::function<bool(std::string_view key, std::string_view bytes)>;

  TableStore() = default;
  TableStore(const TableStore&) = delete;
  TableStore& operator=(const TableStore&) = delete;
  virtual ~TableStore() = default;

  /// All of the writes, in their order, or, on an error, none; after success they survive whatever the store survives.
  /// After an error, a full disk for one, the store is as before and can be read and written on.
  virtual Status commit(std::span<const Write> writes) = 0;
  /// Nothing: no such row.
  [[nodiscard]] virtual Result<std::optional<std::string>> read(std::string_view table, std::string_view key) const = 0;
  /// Rows with keys from `from` on, in the order of their keys, byte by byte as unsigned numbers.
  [[nodiscard]] virtual Status scan(std::string_view table, std::string_view from, const Visit& visit) const = 0;
  using VisitSize = std::function<void(std::string_view key, std::size_t size)>;
  /// All keys in their order, with how many bytes each row has, which are not read. As for scan().
  [[nodiscard]] virtual Status sizes(std::string_view table, const VisitSize& visit) const = 0;
};

/// A key that sorts as the tuple of numbers does: 8 bytes each, most significant first.
std::string key_of(std::initializer_list<std::uint64_t> numbers);
/// The numbers of such a key; nothing when it is none of `count` numbers.
std::optional<std::vector<std::uint64_t>> numbers_of(std::string_view key, std::size_t count);

}  // namespace tutti::storage
