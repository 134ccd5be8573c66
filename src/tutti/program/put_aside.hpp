// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "tutti/bus/envelope.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::program {

/// Remembers which messages have made a node throw. That is a defect of ours, and no message may end a program by it:
/// after kMostThrows times a message is put aside, by the hash of its content, until the program has another version,
/// which may handle it.
class PutAside {
 public:
  static constexpr unsigned kMostThrows = 3;
  static constexpr std::size_t kMost = 1000;  ///< Limit on either list; when it is reached, the list begins anew.

  explicit PutAside(std::string version) : version_(std::move(version)) {}

  /// 16 hexadecimal digits, hashed from sender, kind, id and bytes; for statuses, which all differ, from sender and
  /// kind only.
  static std::string hash_of(const bus::Envelope& message);

  [[nodiscard]] bool contains(const std::string& hash) const { return aside_.contains(hash); }
  /// Notes that the message has made the node throw. True when that was once too often, and the message is put aside.
  bool note(const std::string& hash);
  [[nodiscard]] std::size_t count() const { return aside_.size(); }

  /// Reads the rows "aside/HASH" of this table that this version of the program has written.
  Status read(const storage::TableStore& store, const std::string& table);
  [[nodiscard]] storage::Write to_row(const std::string& table, const std::string& hash) const;

 private:
  std::string version_;
  std::map<std::string, unsigned> throws_;  // by hash, of those that are not put aside yet
  std::set<std::string> aside_;
};

}  // namespace tutti::program
