// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/salvage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <system_error>

#include "tutti/mapfile/make_map.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/node/words.hpp"
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

/// What is lost may have been part of the newest revision: whoever opens the map makes the next one. Without a row of
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
  std::error_code failure;
  if (!fs::is_regular_file(in, failure)) return fail(ErrorCode::io, "{}: no such file, expected a map", in.string());
  fs::copy_file(in, copy, failure);
  if (!failure && fs::exists(in.string() + "-wal"))
    fs::copy_file(in.string() + "-wal", copy.string() + "-wal", failure);
  if (failure) return fail(ErrorCode::io, "{}: cannot be copied: {}", in.string(), failure.message());
  return {};
}

}  // namespace

Result<Salvaged> salvage(const fs::path& in, const fs::path& out) {
  const fs::path copy = part_of(out).string() + ".copy";
  Salvaged salvaged;
  const auto fill = [&](storage::TableStore& map) -> Status {
    if (Status copied = copy_store(in, copy); !copied) return copied;
    Writer writer(map);
    const auto take = [&](std::string_view table, std::string_view key, std::string_view bytes) {
      ++salvaged.rows[std::string(table)];
      return writer.put({std::string(table), std::string(key), std::string(bytes)});
    };
    const auto lost = storage::salvage_sqlite_store(copy, storage::map_schema(), take);
    if (!lost) return in_context(in.string(), lost.error());
    for (const storage::LostRow& row : *lost) salvaged.lost.push_back(name_of(row) + ": " + row.why);
    if (Status written = writer.flush(); !written) return written;
    return note_news(map);
  };
  const Status made = make_map(out, fill);
  remove_store(copy);
  if (!made) return tl::unexpected(made.error());
  return salvaged;
}

}  // namespace tutti::mapfile
