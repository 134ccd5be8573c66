// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/file.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <system_error>

namespace tutti {

Result<std::string> read_file(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return fail(ErrorCode::io, "{}: is a folder, expected a file", path);
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(ErrorCode::io, "{}: cannot open for reading: {}", path, std::strerror(errno));
  constexpr std::size_t kChunk = std::size_t{1} << 18;  // pipes have no size to ask for
  std::string bytes;
  while (file) {
    const std::size_t size = bytes.size();
    bytes.resize(size + kChunk);
    file.read(bytes.data() + size, kChunk);
    bytes.resize(size + static_cast<std::size_t>(file.gcount()));
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
