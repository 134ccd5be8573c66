// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/bags/bag_reader.hpp"
#include "tutti/bags/internal/chunk.hpp"

struct sqlite3;
struct sqlite3_stmt;

namespace tutti::bags {

/// Reads rosbag2's SQLite files (.db3): one row a message, CDR as in MCAP. Neither the file nor its folder is written,
/// but for FILE-shm where a recorder has left its write-ahead log, FILE-wal. An error of SQLite (a damaged page) ends
/// the reading, after the rows before it. A message of more than `most_bytes` is an error, of which nothing is read.
class Db3Reader final : public BagReader {
 public:
  static Result<Db3Reader> open(const std::string& path, std::int64_t most_bytes = internal::kMaxMessageBytes);

  Result<std::optional<BagMessage>> next() override;
  Status seek(const BagPosition& position) override;
  [[nodiscard]] std::vector<const BagChannel*> channels() const override;
  [[nodiscard]] std::string storage() const override { return "SQLite"; }

 private:
  struct Close {
    void operator()(sqlite3* database) const;
    void operator()(sqlite3_stmt* statement) const;
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Close>;

  Db3Reader(std::string name, std::int64_t most_bytes) : name_(std::move(name)), most_bytes_(most_bytes) {}
  Status start(const std::string& uri);
  Status read_topics();
  [[nodiscard]] Result<Statement> prepare(const char* sql) const;
  [[nodiscard]] tl::unexpected<Error> fail_sqlite() const;

  std::string name_;
  std::int64_t most_bytes_;
  std::unique_ptr<sqlite3, Close> database_;
  Statement messages_;
  bool ended_ = false;
  std::map<std::int64_t, BagChannel> channels_;
};

}  // namespace tutti::bags
