// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "tutti/node/update_pacer.hpp"
#include "tutti/server/map_server.hpp"
#include "tutti/storage/map_tables.hpp"
#include "tutti/storage/table_store.hpp"

/// The rows of table `meta` in a map's store.
namespace tutti::node {

/// Visits the rows whose keys begin with `prefix`, in the order of their keys, until a visit fails.
Status each_row_of(const storage::TableStore& map, std::string_view prefix,
                   const std::function<Status(std::string_view key, std::string_view bytes)>& visit);

/// The row `map`: the server's own counters.
struct MapMeta {
  std::uint64_t epoch = 0;
  std::uint64_t revision = 0;
  bool news = false;        ///< Something has come since the last revision.
  std::uint64_t start = 0;  ///< How often the map has been opened; part of jobs' names.
};
storage::Write to_row(const MapMeta& meta);
/// Nothing when no server has opened this map yet.
Result<std::optional<MapMeta>> read_map_meta(const storage::TableStore& map);

/// The row `counts`: figures of the last update, so that they can be reported after a start before the map is computed.
struct MapCounts {
  std::uint64_t revision = 0;
  std::uint64_t keyframes = 0;
  std::uint64_t closures = 0;  ///< Accepted ones.
  std::uint64_t components = 0;
  friend bool operator==(const MapCounts&, const MapCounts&) = default;
};
storage::Write to_row(const MapCounts& counts);
/// Nothing when no update was made, when the program that made it wrote no counts, or when the row cannot be read.
Result<std::optional<MapCounts>> read_map_counts(const storage::TableStore& map);

/// The row `update`: when the last update began, and what it cost, so that a server that starts again makes the next
/// one when it would have made it.
storage::Write to_row(const LastUpdate& update);
/// Nothing when no update was made, when the program that made it wrote no such row, or when the row cannot be read. A
/// cost of more than an hour counts as an hour, so that no file keeps a server from its next update.
Result<std::optional<LastUpdate>> read_last_update(const storage::TableStore& map);

/// The row `settings`: how the server judges closures, so that other readers of the map judge them alike.
storage::Write to_row(const server::ServerConfig& settings);
/// The stored settings, or the defaults when there are none. Settings that only another version knows are ignored, so
/// this program may judge that map slightly differently than its own server does. Fails when the row is damaged.
Result<server::ServerConfig> read_settings(const storage::TableStore& map);

/// Rows `refinement/REVISION`: the refinements that count, as they came. Rows that cannot be read are skipped, because
/// the refinement is then made again.
std::string refinement_key(std::uint64_t revision);
Result<server::Refinements> read_refinements(const storage::TableStore& map);

/// Rows `place/SUBMAP`: the appearance of the submaps' places, and their candidates. Encoded as numbers of 8 bytes
/// (whether it was compared, how many candidates; for each its robot, session, index plus 2^32 times the sensor, and
/// the bits of its likeness), followed by its appearance. Rows that cannot be read are skipped: the pairs of these
/// submaps are all verified.
storage::Write to_row(SubmapId id, const server::Place& place);
/// The key of a submap's row.
std::string place_key(SubmapId id);
/// The place of a row; nothing when it is no such row.
std::optional<std::pair<SubmapId, server::Place>> place_of_row(std::string_view key, std::string_view bytes);
Result<server::PlaceSet> read_places(const storage::TableStore& map);

/// Rows `held/SUBMAP` of a map that does not move: the poses of the submap's keyframes in its world, 8 numbers each
/// (the keyframe's index plus 2^32 times the floor's number; the bits of x, y, z and of the quaternion's x, y, z, w).
storage::Write to_row(SubmapId id, const std::vector<std::pair<std::uint32_t, server::HeldPose>>& held);
/// All of them; empty for a map whose poses may all move. Fails when a row is damaged: the map could move unseen.
Result<server::HeldPoses> read_held_poses(const storage::TableStore& map);

/// A row `retired/SUBMAP` of a submap that is retired (server/known_ground.hpp); it has no bytes.
storage::Write retired_row(SubmapId id);
/// All of them. Fails when a row is damaged: the map would be another one.
Result<std::set<SubmapId>> read_retired(const storage::TableStore& map);

/// A row `robot/NUMBER` (RobotRegistry::key()): a robot's name and its sessions. It is encoded as numbers of 8 bytes
/// (the session, the number of former sessions, the number of rivals, then those sessions), followed by the name.
struct RobotRow {
  static constexpr std::size_t kMostSessions = 100;  ///< Limit on former sessions, and on rivals.
  std::string name;
  std::uint64_t session = 0;
  std::set<std::uint64_t> former;
  std::set<std::uint64_t> rivals;
};
std::string encode(const RobotRow& row);
/// Nothing when the bytes are no such row.
std::optional<RobotRow> decode_robot(std::string_view bytes);
/// The names of all robots that have such a row. Fails when the table cannot be read.
Result<std::map<RobotId, std::string>> read_robot_names(const storage::TableStore& map);

}  // namespace tutti::node
