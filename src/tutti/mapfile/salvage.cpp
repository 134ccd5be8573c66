// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/salvage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <span>
#include <system_error>

#include "tutti/mapfile/check_map_file.hpp"
#include "tutti/mapfile/make_map.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/robot_tables.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/storage/sqlite_salvage.hpp"

namespace tutti::mapfile {

namespace fs = std::filesystem;
namespace {

/// A row as people know it.
std::string name_of(const storage::LostRow& row) {
  if (row.key.empty()) return row.table;
  if (const auto id = node::submap_of_key(row.key)) return fmt::format("{}: submap {}", row.table, to_string(*id));
  if (const auto pair = node::pair_of(row.key))
    return fmt::format("{}: the pair {} and {}", row.table, to_string(pair->first), to_string(pair->second));
  const bool is_plain = std::ranges::all_of(row.key, [](unsigned char c) { return std::isprint(c) != 0; });
  return is_plain ? fmt::format("{}: '{}'", row.table, row.key) : fmt::format("{}: a row", row.table);
}

/// Lost rows may have been part of the newest revision: whoever opens the map makes the next one. Without a row of
/// its own a map would count as empty.
Status note_news(storage::TableStore& map) {
  auto meta = node::read_map_meta(map);
  node::MapMeta known = meta && *meta ? **meta : node::MapMeta{.epoch = 1};
  known.news = true;
  const std::vector<storage::Write> row{node::to_row(known)};
  return map.commit(row);
}

/// With the log that is part of it.
Status copy_store(const fs::path& in, const fs::path& copy) {
  if (Status known = check_map_file(in); !known) return known;
  std::error_code failure;
  fs::copy_file(in, copy, failure);
  if (!failure && fs::exists(in.string() + "-wal"))
    fs::copy_file(in.string() + "-wal", copy.string() + "-wal", failure);
  if (failure) return fail(ErrorCode::io, "{}: cannot be copied: {}", in.string(), failure.message());
  return {};
}

/// A robot's, but for its state; the submaps first.
const std::vector<std::string>& tables_of(const storage::Schema& schema) {
  using namespace node::robot_tables;  // NOLINT
  static const std::vector<std::string> robots{kOutbox, kArchive, kMeta};
  return schema.kind == storage::robot_schema().kind ? robots : schema.tables;
}

/// A store without its first page is read as one that was made by this program. In robots' stores that were made before
/// they had an archive, `meta` is in its place.
std::string table_of(std::string_view from, std::string_view key) {
  using namespace node::robot_tables;  // NOLINT
  return std::string(from == kArchive && !node::submap_of_key(key) ? kMeta : from);
}

/// So that the robot begins a session that nobody has begun before, and reports why.
Status note_lost(storage::TableStore& robot, const std::string& why, std::uint64_t now_ns) {
  using namespace node::robot_tables;  // NOLINT
  const auto row = robot.read(kMeta, kSession);
  if (!row) return tl::unexpected(row.error());
  const auto known = storage::numbers_of(row->value_or(""), 1);
  const std::uint64_t newest = std::max(known ? known->front() : 0, now_ns);
  const std::vector<storage::Write> writes{{kMeta, kSession, storage::key_of({newest})}, {kMeta, kLost, why}};
  return robot.commit(writes);
}

Result<Salvaged> salvage_kind(const fs::path& in, const fs::path& out, std::span<const storage::Schema> schemas,
                              const std::string& why, std::uint64_t now_ns) {
  const fs::path copy = part_of(out).string() + ".copy";
  Salvaged salvaged;
  const auto salvage_copy = [&]() -> Status {
    remove_store(copy);
    if (Status copied = copy_store(in, copy); !copied) return copied;
    auto damaged = storage::DamagedStore::open(copy, schemas);
    if (!damaged) {  // it names the copy
      std::string_view text = damaged.error().message;
      const std::string of_copy = copy.string() + ": ";
      if (text.starts_with(of_copy)) text.remove_prefix(of_copy.size());
      return fail(damaged.error().code, "{}: {}", in.string(), text);
    }
    salvaged.kind = damaged->schema().kind;
    return make_store(out, damaged->schema(), [&](storage::TableStore& store) -> Status {
      Writer writer(store);
      const auto take = [&](std::string_view from, std::string_view key, std::string_view bytes) {
        const std::string table = table_of(from, key);
        ++salvaged.rows[table];
        return writer.put({table, std::string(key), std::string(bytes)});
      };
      const auto lost = damaged->read(tables_of(damaged->schema()), take);
      if (!lost) return in_context(in.string(), lost.error());
      for (const storage::LostRow& row : *lost) salvaged.lost.push_back(name_of(row) + ": " + row.why);
      if (Status written = writer.flush(); !written) return written;
      return salvaged.kind == storage::map_schema().kind ? note_news(store) : note_lost(store, why, now_ns);
    });
  };
  const Status made = salvage_copy();
  remove_store(copy);
  if (!made) return tl::unexpected(made.error());
  return salvaged;
}

}  // namespace

Result<Salvaged> salvage(const fs::path& in, const fs::path& out, std::uint64_t now_ns) {
  const std::array schemas{storage::map_schema(), storage::robot_schema()};
  return salvage_kind(in, out, schemas, "it was damaged, and salvaged by hand", now_ns);
}

Result<Salvaged> salvage_robot(const fs::path& in, const fs::path& out, const std::string& why, std::uint64_t now_ns) {
  return salvage_kind(in, out, {&storage::robot_schema(), 1}, why, now_ns);
}

Status make_robot_store(const fs::path& out, const std::string& why, std::uint64_t now_ns) {
  return make_store(out, storage::robot_schema(),
                    [&](storage::TableStore& robot) { return note_lost(robot, why, now_ns); });
}

}  // namespace tutti::mapfile
