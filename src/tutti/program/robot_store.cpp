// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/robot_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

#include "tutti/mapfile/make_map.hpp"
#include "tutti/mapfile/salvage.hpp"
#include "tutti/storage/sqlite_salvage.hpp"

namespace tutti::program {

namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMostNamed = 5;  // rows

fs::path salvaged_of(const fs::path& folder) { return folder / "robot.salvaged.tutti"; }

/// The salvaged store takes the damaged one's place. The log goes first: it is no other file's.
Result<fs::path> exchange(const fs::path& folder) {
  const fs::path file = folder / kRobotFile;
  std::error_code failure;
  fs::path aside;
  for (int number = 1; aside.empty() || fs::exists(aside, failure); ++number)
    aside = folder / fmt::format("robot.damaged-{}.tutti", number);
  const auto move = [&](const fs::path& from, const fs::path& to) {
    if (!failure && fs::exists(from, failure)) fs::rename(from, to, failure);
  };
  for (const char* end : {"-wal", "-shm", "-journal", ""}) move(file.string() + end, aside.string() + end);
  move(salvaged_of(folder), file);
  if (failure) return fail(ErrorCode::io, "{}: cannot be set aside: {}", file.string(), failure.message());
  return aside;
}

Result<std::unique_ptr<storage::TableStore>> open_whole(const fs::path& file, const storage::SqliteOptions& options) {
  auto store = storage::open_sqlite_store(file, storage::robot_schema(), options);
  if (store)
    if (Status whole = storage::check_rows(**store, storage::robot_schema()); !whole)
      return tl::unexpected(whole.error());
  return store;
}

/// Says what is kept and what is lost, for people.
std::string summary(const mapfile::Salvaged& salvaged) {
  const auto submaps = salvaged.rows.find("outbox");
  std::string out = fmt::format("{} submaps are kept", submaps == salvaged.rows.end() ? 0 : submaps->second);
  for (std::size_t i = 0; i < std::min(kMostNamed, salvaged.lost.size()); ++i)
    out += (i == 0 ? "; lost: " : "; ") + salvaged.lost[i];
  if (salvaged.lost.size() > kMostNamed) out += fmt::format("; and {} more", salvaged.lost.size() - kMostNamed);
  return out;
}

}  // namespace

Result<RobotStore> open_robot_store(const fs::path& folder, std::uint64_t now_ns,
                                    const storage::SqliteOptions& options) {
  const fs::path file = folder / kRobotFile;
  std::error_code failure;
  if (fs::exists(salvaged_of(folder), failure))  // it is whole; a program was killed before it was in its place
    if (const auto done = exchange(folder); !done) return tl::unexpected(done.error());
  auto store = open_whole(file, options);
  if (store) return RobotStore{std::move(*store), {}};
  if (store.error().code != ErrorCode::parse) return tl::unexpected(store.error());

  const std::string why = store.error().message;
  const auto salvaged = mapfile::salvage_robot(file, salvaged_of(folder), why, now_ns);
  if (!salvaged && salvaged.error().code != ErrorCode::parse) return tl::unexpected(salvaged.error());
  if (!salvaged)
    if (Status made = mapfile::make_robot_store(salvaged_of(folder), why, now_ns); !made)
      return tl::unexpected(made.error());
  const auto aside = exchange(folder);
  if (!aside) return tl::unexpected(aside.error());
  store = open_whole(file, options);
  if (!store) return tl::unexpected(store.error());
  return RobotStore{std::move(*store),
                    fmt::format("what is stored was damaged ({}); it is set aside as {}; {}", why, aside->string(),
                                salvaged ? summary(*salvaged) : "nothing of it can be read")};
}

}  // namespace tutti::program
