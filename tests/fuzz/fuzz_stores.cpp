// SPDX-License-Identifier: BSD-3-Clause
// The contents of stores, and what is left of them.
#include <unistd.h>

#include <Eigen/LU>
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "fuzz/fuzz_target.hpp"
#include "tutti/base/check.hpp"
#include "tutti/base/file.hpp"
#include "tutti/formats/fix_file.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/node/internal/opened_map.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/storage/sqlite_salvage.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::fuzz {
namespace {

namespace fs = std::filesystem;

/// A folder of this process, which goes with it.
struct Folder {
  Folder() { fs::create_directories(path); }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  const fs::path path = fs::temp_directory_path() / ("tutti_fuzz_" + std::to_string(getpid()));
};
fs::path file_of(const char* name) {
  static const Folder folder;
  return folder.path / name;
}

std::string rows(const std::vector<std::pair<std::string, std::string>>& of) {
  std::string out;
  for (const auto& [key, bytes] : of) {
    out.append(key).push_back(kNextFile);
    out.append(bytes).push_back(kNextFile);
  }
  return out;
}

std::string small_map() {
  const fs::path file = file_of("seed");
  std::vector<storage::Write> writes{node::to_row(node::MapMeta{.epoch = 9, .revision = 3, .news = true, .start = 2})};
  for (std::uint64_t i = 0; i < 12; ++i)
    writes.push_back({i % 3 == 0 ? "verdicts" : "submaps", storage::key_of({0, 7, i}), std::string(10 * i * i, 'a')});
  fs::remove(file);
  static_cast<void>(
      storage::open_sqlite_store(file, storage::map_schema(), {.min_free_bytes = 0}).value()->commit(writes));
  return read_file(file.string()).value();
}

}  // namespace

/// Keys and bytes in turn: as the rows `meta` of a map, which a server and a reader open, and of a robot's store, which
/// is opened, goes on, and is opened again.
void meta_rows(std::string_view bytes) {
  storage::MemoryStore::Tables tables;
  while (!bytes.empty()) {
    std::string parts[2];
    for (std::string& part : parts) {
      const std::size_t end = std::min(bytes.find(kNextFile), bytes.size());
      part = bytes.substr(0, end);
      bytes.remove_prefix(std::min(end + 1, bytes.size()));
    }
    tables["meta"][parts[0]] = parts[1];
  }
  storage::MemoryStore robot(storage::robot_schema(), tables);
  if (const auto opened = node::RobotNode::open(RobotId{1}, 7, {}, robot)) {
    TUTTI_CHECK(robot.commit((*opened)->resume({}).writes).has_value());
    TUTTI_CHECK(node::RobotNode::open(RobotId{1}, 7, {}, robot).has_value(), "what it has stored is refused");
  }
  const auto own = node::to_row(node::MapMeta{.epoch = 9, .revision = 3, .news = true, .start = 2});
  tables["meta"].try_emplace(own.key, *own.bytes);
  const storage::MemoryStore map(storage::map_schema(), tables);
  static_cast<void>(node::OpenedMap::from(map, {}));
  static_cast<void>(mapfile::read(map));
}

/// A file of any content: the rows that are taken cannot be more than what is in it.
void salvage(std::string_view bytes) {
  const fs::path file = file_of("store");
  for (const char* end : {"-wal", "-shm", "-journal"}) fs::remove(file.string() + end);
  TUTTI_CHECK(write_file(file.string(), std::string(bytes)).has_value());
  const std::vector<storage::Schema> schemas{storage::map_schema(), storage::robot_schema()};
  auto store = storage::DamagedStore::open(file, schemas);
  if (!store) return;
  std::size_t taken = 0;
  const auto take = [&](std::string_view, std::string_view key, std::string_view row) {
    taken += key.size() + row.size();
    return Status();
  };
  static_cast<void>(store->read(store->schema().tables, take));
  TUTTI_CHECK(taken <= 2 * bytes.size(), "{} bytes of rows in a file of {}", taken, bytes.size());
}

void fixes(std::string_view bytes) {
  const auto read = formats::parse_fixes(bytes, "fuzz");
  if (!read) return;
  for (const PositionFix& fix : *read) {
    TUTTI_CHECK(check_fix(fix.antenna, fix.covariance, fix.p_body_antenna).has_value(), "what was read is refused");
    TUTTI_CHECK(invertible_fix_covariance(fix.covariance).inverse().allFinite(), "it has no inverse");
  }
}

std::map<std::string, std::vector<std::string>> store_seeds() {
  const std::string robot =
      node::encode(node::RobotRow{.name = "alpha", .session = 7, .former = {3, 4}, .rivals = {5}});
  const SubmapId submap{ChainId(RobotId{1}, 7), 2};
  const auto place = node::to_row(submap, {.looks = "a", .is_ranked = true, .candidates = {{submap, 0.5}}});
  return {{"fixes",
           {"stamp_s,latitude_deg,longitude_deg,height_m,sigma_east_m,sigma_north_m,sigma_up_m\n"
            "1700000000.25,46.5,6.6,400.0,0.5,0.5,1.0\n1700000001.25,46.50001,6.6,400.5,0.01,0.02,5\n"}},
          {"meta_rows",
           {rows({{"map", storage::key_of({9, 3, 1, 2})},
                  {"counts", storage::key_of({3, 100, 20, 1})},
                  {"settings", "broadcast: own\nmap:\n  most_closed_pairs: 40\n"},
                  {"robot/1", robot},
                  {place.key, *place.bytes}}),
            rows({{"robot", storage::key_of({1})},
                  {"starts", storage::key_of({4})},
                  {"session", storage::key_of({7})},
                  {"incarnations", storage::key_of({8, 9})},
                  {"lost", "it was damaged"}})}},
          {"salvage", {small_map()}}};
}

}  // namespace tutti::fuzz
