// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/own_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

namespace tutti {
namespace {

namespace fs = std::filesystem;

/// errno of what failed; 0: all is written.
int write_all(int file, std::string_view text, bool durable) {
  while (!text.empty()) {
    const ssize_t size = ::write(file, text.data(), text.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) return errno;
    text.remove_prefix(static_cast<std::size_t>(size));
  }
  return durable && fsync(file) != 0 ? errno : 0;
}

}  // namespace

Result<int> open_own_file(const fs::path& file, int flags, unsigned mode) {
  // O_NONBLOCK: opening a FIFO would wait for its other end.
  const int opened = ::open(file.c_str(), flags | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK, mode);
  const int why = errno;
  if (opened < 0 && why == ELOOP)
    return fail(ErrorCode::io, "{}: is a symbolic link, expected a file of this program's own", file.string());
  if (opened < 0) return fail(ErrorCode::io, "{}: cannot be opened: {}", file.string(), std::strerror(why));
  struct stat found {};
  if (fstat(opened, &found) == 0 && S_ISREG(found.st_mode)) return opened;
  close(opened);
  return fail(ErrorCode::io, "{}: is no regular file, expected a file of this program's own", file.string());
}

fs::path beside_of(const fs::path& file) { return file.string() + ".new"; }

Status replace_file(const fs::path& file, std::string_view text, bool durable, unsigned mode) {
  const fs::path beside = beside_of(file);
  ::unlink(beside.c_str());  // of a program that was killed, or somebody's link
  const auto opened = open_own_file(beside, O_WRONLY | O_CREAT | O_EXCL, mode);
  if (!opened) return tl::unexpected(opened.error());
  int why = write_all(*opened, text, durable);
  if (close(*opened) != 0 && why == 0) why = errno;
  if (why != 0) return fail(ErrorCode::io, "{}: cannot be written: {}", beside.string(), std::strerror(why));
  std::error_code error;
  fs::rename(beside, file, error);
  if (error) return fail(ErrorCode::io, "{}: cannot be written: {}", file.string(), error.message());
  return {};
}

}  // namespace tutti
