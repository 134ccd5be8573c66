// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/storage/sqlite_copy.hpp"

#include <fmt/format.h>

#include <fstream>
#include <string>
#include <system_error>

namespace tutti::storage {
namespace {

namespace fs = std::filesystem;

constexpr int kMostTries = 10;

/// Which log it is: SQLite gives a log that begins anew other salts (https://www.sqlite.org/fileformat2.html, 4.1).
/// Empty: there is none.
std::string log_header(const fs::path& log) {
  constexpr std::size_t kHeader = 32;
  std::string out(kHeader, '\0');
  std::ifstream in(log, std::ios::binary);
  in.read(out.data(), static_cast<std::streamsize>(out.size()));
  out.resize(static_cast<std::size_t>(in.gcount()));
  return out;
}

}  // namespace

/// SQLite writes only at the end of a log, and it writes pages to the file that are in the log. So, as after a crash,
/// whatever a copy of the file has in the middle of a page, the log has whole, provided that it is the same log
/// throughout and is copied last. Frames at its end that are not whole do not have their checksums, and do not count.
Status copy_sqlite_store(const fs::path& from, const fs::path& to) {
  const fs::path log = from.string() + "-wal", log_copy = to.string() + "-wal";
  std::error_code failure;
  for (int i = 0; i < kMostTries; ++i) {
    if (fs::exists(from.string() + "-journal", failure))
      return fail(ErrorCode::io, "{}: is just being made by another program", from.string());
    const std::string before = log_header(log);
    fs::remove(log_copy, failure);
    if (!fs::copy_file(from, to, fs::copy_options::overwrite_existing, failure))
      return fail(ErrorCode::io, "{}: cannot be copied to {}: {}", from.string(), to.string(), failure.message());
    const bool has_log = !before.empty() && fs::copy_file(log, log_copy, failure);
    const bool is_whole = before.empty() || (has_log && log_header(log_copy) == before);
    if (is_whole && log_header(log) == before) return {};
  }
  return fail(ErrorCode::io, "{}: changes faster than it can be copied: {} tries", from.string(), kMostTries);
}

}  // namespace tutti::storage
