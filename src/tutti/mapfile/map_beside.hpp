// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "tutti/mapfile/shown_map.hpp"

namespace tutti::mapfile {

/// The map of a server, read by another program beside it: what it is made of from the map's file, each row once, and
/// what the server has computed from the file that it writes after each update. For one thread.
class MapBeside {
 public:
  /// `map`: the map's file, as open_sqlite_reader() opens it, must outlive this. `estimate`: the server's file of
  /// encode_estimate().
  MapBeside(const storage::TableStore& map, std::filesystem::path estimate)
      : store_(map), estimate_(std::move(estimate)) {}
  /// Whether the server has written an estimate that newest() has not read.
  [[nodiscard]] bool has_news() const;
  /// The newest map; null: there is none yet, or it is of another map than the file's. Submaps that came after the
  /// estimate are there without a pose.
  Result<std::shared_ptr<const ShownMap>> newest();

 private:
  /// Differs from one written file to the next.
  using Written = std::pair<std::filesystem::file_time_type, std::uintmax_t>;
  [[nodiscard]] Written written() const;
  Status read_rows();

  const storage::TableStore& store_;
  std::filesystem::path estimate_;
  Written read_{};
  Content content_;                                // what was read so far
  std::map<std::string, std::size_t> verdicts_{};  // sizes of their rows, by key
};

}  // namespace tutti::mapfile
