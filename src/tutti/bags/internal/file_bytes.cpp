// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/internal/file_bytes.hpp"

#include <fstream>
#include <limits>
#include <utility>

#include "tutti/base/file.hpp"

namespace tutti::bags::internal {

Result<FileBytes> FileBytes::open(const std::string& path) {
  auto file = open_file(path);
  if (!file) return tl::unexpected(file.error());
  return open(std::make_unique<std::ifstream>(std::move(*file)), path);
}

Result<FileBytes> FileBytes::open(std::unique_ptr<std::istream> stream, std::string name) {
  FileBytes out(std::move(stream), std::move(name));
  out.stream_->seekg(0, std::ios::end);
  const auto end = out.stream_->tellg();
  if (!*out.stream_ || end < 0 || end == std::numeric_limits<std::streamoff>::max())
    return fail(ErrorCode::io, "{}: its size is not known: expected a file", out.name_);
  out.size_ = out.at_ = static_cast<std::uint64_t>(end);
  return out;
}

Status FileBytes::read(std::uint64_t offset, std::uint64_t size, std::string& out) {
  if (at_ != offset) {
    stream_->clear();
    stream_->seekg(static_cast<std::streamoff>(offset));
  }
  out.resize(size);
  stream_->read(out.data(), static_cast<std::streamsize>(size));
  at_ = *stream_ ? offset + size : size_ + 1;
  if (!*stream_) return fail(ErrorCode::io, "{}: byte {}: {} bytes cannot be read", name_, offset, size);
  return {};
}

}  // namespace tutti::bags::internal
