// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/file.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace tutti {

namespace {

const char* in_words(std::filesystem::file_type type) {
  using enum std::filesystem::file_type;
  return type == directory ? "a folder" : type == fifo ? "a pipe" : type == socket ? "a socket" : "a device";
}

}  // namespace

Result<std::ifstream> open_file(const std::string& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    return fail(ErrorCode::io, "{}: is {}, expected a file", path, in_words(status.type()));
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(ErrorCode::io, "{}: cannot be opened: {}", path, std::strerror(errno));
  return file;
}

Result<std::string> read_file(const std::string& path, std::size_t most_bytes) {
  auto opened = open_file(path);
  if (!opened) return tl::unexpected(opened.error());
  std::ifstream& file = *opened;
  constexpr std::size_t kChunk = std::size_t{1} << 18;  // the files of /proc do not know their size
  std::string bytes;
  while (file) {
    const std::size_t size = bytes.size();
    bytes.resize(size + kChunk);
    file.read(bytes.data() + size, kChunk);
    bytes.resize(size + static_cast<std::size_t>(file.gcount()));
    if (bytes.size() > most_bytes) return fail(ErrorCode::io, "{}: has more than {} bytes", path, most_bytes);
  }
  if (file.bad()) return fail(ErrorCode::io, "{}: cannot read: {}", path, std::strerror(errno));
  return bytes;
}

Status write_file(const std::string& path, std::string_view bytes) {
  errno = 0;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!file) return fail(ErrorCode::io, "{}: cannot open for writing: {}", path, std::strerror(errno));
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) return fail(ErrorCode::io, "{}: cannot write {} bytes: {}", path, bytes.size(), std::strerror(errno));
  return {};
}

}  // namespace tutti
