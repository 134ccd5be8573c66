// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "tutti/server/map_server.hpp"
#include "tutti/storage/table_store.hpp"

/// The rows of a map's table `meta`.
namespace tutti::node {

inline constexpr const char* kMetaTable = "meta";

/// The row `map`: what the server itself was about.
struct MapMeta {
  std::uint64_t epoch = 0;
  std::uint64_t revision = 0;
  bool news = false;        ///< Something has come since the last revision.
  std::uint64_t start = 0;  ///< How often the map has been opened; names jobs.
};
storage::Write to_row(const MapMeta& meta);
/// Nothing: no server has had this map yet.
Result<std::optional<MapMeta>> read_map_meta(const storage::TableStore& map);

/// The row `counts`: what the last update made of the map, so that it can be told before it is computed again.
struct MapCounts {
  std::uint64_t revision = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t closures = 0;  ///< Accepted.
  std::uint64_t components = 0;
  friend bool operator==(const MapCounts&, const MapCounts&) = default;
};
storage::Write to_row(const MapCounts& counts);
/// Nothing: no update has been made of this map, or none by a program that wrote them. A row that cannot be read is
/// none.
Result<std::optional<MapCounts>> read_map_counts(const storage::TableStore& map);

/// The row `settings`: what the server judges closures by, so that whoever reads the map sees it as the server does.
storage::Write to_row(const server::ServerConfig& settings);
/// The defaults where there is none. Settings that only another version knows are left alone: its map may then be
/// judged a little otherwise than by its own server. An error: the row is damaged.
Result<server::ServerConfig> read_settings(const storage::TableStore& map);

/// Rows `refinement/REVISION`: the refinements that hold, as they came. One that cannot be read is none: it is made
/// again.
std::string refinement_key(std::uint64_t revision);
Result<server::Refinements> read_refinements(const storage::TableStore& map);

/// A row `robot/NUMBER` (RobotRegistry::key()): a robot's name, and the sessions that go by it. 8 bytes each: its
/// session, how many it had before, how many others were refused, these; then the name.
struct RobotRow {
  static constexpr std::size_t kMostSessions = 100;  ///< Former ones and rivals each.
  std::string name;
  std::uint64_t session = 0;
  std::set<std::uint64_t> former;
  std::set<std::uint64_t> rivals;
};
std::string encode(const RobotRow& row);
/// Nothing: the bytes are none.
std::optional<RobotRow> decode_robot(std::string_view bytes);
Result<std::map<RobotId, std::string>> read_robot_names(const storage::TableStore& map);

}  // namespace tutti::node
