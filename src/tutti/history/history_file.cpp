// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/history/history_file.hpp"

#include <fmt/format.h>

#include "tutti/base/folder.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::history {
namespace {

namespace fs = std::filesystem;

constexpr double kShareOfMemory = 0.1;

Result<std::unique_ptr<History>> open_file(const fs::path& file, const HistoryOptions& options) {
  if (Status made = make_folder_of(file); !made) return tl::unexpected(made.error());
  auto store = storage::open_sqlite_store(file, schema(), {.max_bytes = kMostFile});
  if (!store) return tl::unexpected(store.error());
  return History::open(std::move(*store), options);
}

std::unique_ptr<History> in_memory(HistoryOptions options) {
  options.share *= kShareOfMemory;
  return std::move(*History::open(std::make_unique<storage::MemoryStore>(schema()), options));
}

/// With what SQLite leaves beside it.
bool set_aside(const fs::path& file) {
  std::error_code failed;
  fs::rename(file, file.string() + ".aside", failed);
  if (failed) return false;
  std::error_code ignored;
  for (const char* end : {"-wal", "-journal"}) {
    fs::remove(file.string() + ".aside" + end, ignored);
    fs::rename(file.string() + end, file.string() + ".aside" + end, ignored);
  }
  return true;
}

}  // namespace

OpenedHistory open_history(const fs::path& file, const HistoryOptions& options) {
  if (file.empty()) return {in_memory(options), ""};
  auto opened = open_file(file, options);
  if (opened) return {std::move(*opened), ""};
  std::string said = opened.error().message;
  if (opened.error().code != ErrorCode::io && set_aside(file)) {
    said = fmt::format("the past until now is set aside as {}.aside: {}", file.string(), said);
    opened = open_file(file, options);
    if (opened) return {std::move(*opened), said};
  }
  return {in_memory(options), fmt::format("the past is kept in memory only: {}", said)};
}

}  // namespace tutti::history
