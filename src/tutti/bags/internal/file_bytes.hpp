// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <istream>
#include <memory>
#include <string>

#include "tutti/base/result.hpp"

namespace tutti::bags::internal {

/// A file that is read anywhere, mostly from front to back.
class FileBytes {
 public:
  static Result<FileBytes> open(const std::string& path);
  /// `name` is for the errors. An error: it is no file, and has no size.
  static Result<FileBytes> open(std::unique_ptr<std::istream> stream, std::string name);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }
  /// Puts the bytes from `offset` on into `out`.
  Status read(std::uint64_t offset, std::uint64_t size, std::string& out);

 private:
  FileBytes(std::unique_ptr<std::istream> stream, std::string name)
      : stream_(std::move(stream)), name_(std::move(name)) {}

  std::unique_ptr<std::istream> stream_;
  std::string name_;
  std::uint64_t size_ = 0;
  std::uint64_t at_ = 0;  // seeking costs what is buffered: it is done only where the stream is not there yet
};

}  // namespace tutti::bags::internal
