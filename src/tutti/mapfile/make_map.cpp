// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/make_map.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>
#include <utility>

#include "tutti/base/folder.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti::mapfile {

namespace fs = std::filesystem;
namespace {

/// Not in the place of a file that somebody else has made meanwhile, where the file system can detect it.
bool take_name(const fs::path& part, const fs::path& out) {
  if (::renameat2(AT_FDCWD, part.c_str(), AT_FDCWD, out.c_str(), RENAME_NOREPLACE) == 0) return true;
  return errno == EINVAL && ::rename(part.c_str(), out.c_str()) == 0;
}

}  // namespace

Status Writer::put(storage::Write write) {
  bytes_ += write.bytes->size();
  writes_.push_back(std::move(write));
  return bytes_ < kPortion ? Status() : flush();
}

Status Writer::flush() {
  Status done = out_.commit(writes_);
  writes_.clear();
  bytes_ = 0;
  return done;
}

fs::path part_of(const fs::path& out) { return out.string() + fmt::format(".part-{}", getpid()); }

void remove_store(const fs::path& file) {
  std::error_code failure;
  for (const char* end : {"", "-wal", "-shm", "-journal"}) fs::remove(file.string() + end, failure);
}

Status make_store(const fs::path& out, const storage::Schema& schema,
                  const std::function<Status(storage::TableStore&)>& fill) {
  std::error_code failure;
  if (fs::exists(out, failure)) return fail(ErrorCode::io, "{}: is there already", out.string());
  if (auto folder = make_folder_of(out); !folder) return folder;
  const fs::path part = part_of(out);
  remove_store(part);
  Status done;
  {
    auto made = storage::open_sqlite_store(part, schema);
    done = made ? fill(**made) : tl::unexpected(made.error());
  }  // closed: one file
  if (done && !take_name(part, out))
    done = fail(ErrorCode::io, "{}: cannot be written: {}", out.string(), std::generic_category().message(errno));
  remove_store(part);
  if (!done) return done;
  const fs::path folder = out.has_parent_path() ? out.parent_path() : fs::path(".");
  if (const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY); fd >= 0) {  // the name, too, is on the disk
    ::fsync(fd);
    ::close(fd);
  }
  return {};
}

Status make_map(const fs::path& out, const std::function<Status(storage::TableStore&)>& fill) {
  return make_store(out, storage::map_schema(), fill);
}

Status copy_rows(const storage::TableStore& from, storage::TableStore& to) {
  Writer writer(to);
  for (const std::string& table : storage::map_schema().tables) {
    Status put;
    const Status scanned = from.scan(table, {}, [&](std::string_view key, std::string_view bytes) {
      put = writer.put({table, std::string(key), std::string(bytes)});
      return put.has_value();
    });
    if (!scanned) return scanned;
    if (!put) return put;
  }
  return writer.flush();
}

Status copy_map(const storage::TableStore& from, const fs::path& out) {
  return make_map(out, [&from](storage::TableStore& to) { return copy_rows(from, to); });
}

}  // namespace tutti::mapfile
