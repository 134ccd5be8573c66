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

/// Which messages have made a node throw. That is a defect of ours, which no message may turn into the end of a
/// program: who has done it kMostThrows times is put aside, by the hash of what it says, until another version of the
/// program is there, which may know better.
class PutAside {
 public:
  static constexpr unsigned kMostThrows = 3;
  static constexpr std::size_t kMost = 1000;  ///< Remembered of each kind; beyond, it begins anew.

  explicit PutAside(std::string version) : version_(std::move(version)) {}

  /// 16 hexadecimal digits over sender, kind, id and bytes. Of a status, each of which is another, over sender and
  /// kind.
  static std::string hash_of(const bus::Envelope& message);

  [[nodiscard]] bool contains(const std::string& hash) const { return aside_.contains(hash); }
  /// It has made the node throw. True: that was once too often, and from now on it is put aside.
  bool note(const std::string& hash);
  [[nodiscard]] std::size_t count() const { return aside_.size(); }

  /// What is remembered in the rows "aside/HASH" of this table, of this version.
  Status read(const storage::TableStore& store, const std::string& table);
  [[nodiscard]] storage::Write to_row(const std::string& table, const std::string& hash) const;

 private:
  std::string version_;
  std::map<std::string, unsigned> throws_;  // by hash, of those that are not put aside yet
  std::set<std::string> aside_;
};

}  // namespace tutti::program
