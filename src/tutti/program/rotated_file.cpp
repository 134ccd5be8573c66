// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/rotated_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "tutti/base/own_file.hpp"

namespace tutti::program {

namespace fs = std::filesystem;

Result<RotatedFile> RotatedFile::open(const fs::path& file, std::uintmax_t max_bytes, Heading heading) {
  RotatedFile made(file, max_bytes, std::move(heading));
  if (Status begun = made.begin(0); !begun) return tl::unexpected(begun.error());
  made.is_torn_ = made.bytes_ > 0;  // by a kill, maybe; an empty line does no harm
  return made;
}

RotatedFile::~RotatedFile() {
  if (file_ >= 0) close(file_);
}

fs::path RotatedFile::older_of(const fs::path& file) {
  return file.parent_path() / (file.stem().string() + ".1" + file.extension().string());
}

Status RotatedFile::begin(int flags) {
  const auto opened = open_own_file(path_, O_WRONLY | O_CREAT | O_APPEND | flags);
  if (!opened) return tl::unexpected(opened.error());
  file_ = *opened;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path_, error);
  bytes_ = error ? 0 : size;
  return {};
}

void RotatedFile::write(std::string_view text) {
  while (!text.empty()) {
    const ssize_t size = ::write(file_, text.data(), text.size());
    if (size < 0 && errno == EINTR) continue;
    if (size < 0) break;
    bytes_ += static_cast<std::uintmax_t>(size);
    is_torn_ = text[static_cast<std::size_t>(size) - 1] != '\n';
    text.remove_prefix(static_cast<std::size_t>(size));
  }
}

void RotatedFile::append(std::string_view line) {
  if (bytes_ > max_bytes_) {
    if (file_ >= 0) close(std::exchange(file_, -1));
    std::error_code ignored;
    fs::rename(path_, older_of(path_), ignored);
    bytes_ = 0;
  }
  if (file_ < 0) {
    if (!begin(O_TRUNC)) return;  // and again with the next line
    is_torn_ = false;
    if (heading_) write(heading_());
  }
  if (is_torn_) write("\n");
  write(line);
}

}  // namespace tutti::program
