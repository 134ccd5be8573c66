// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "tutti/base/result.hpp"

namespace tutti::program {

/// A file of lines in a program's own folder, to which lines are appended. When it is full it becomes the older file,
/// NAME.1.EXTENSION, in the place of the one before, and a new one is begun. Lines that cannot be written, for example
/// because the disk is full, are lost.
class RotatedFile {
 public:
  /// The beginning of a new file when another one was full.
  using Heading = std::function<std::string()>;
  /// Continues the file. Fails when it cannot be opened, or is a link.
  static Result<RotatedFile> open(const std::filesystem::path& file, std::uintmax_t max_bytes, Heading heading = {});
  ~RotatedFile();
  RotatedFile(RotatedFile&& other) noexcept
      : path_(std::move(other.path_)),
        max_bytes_(other.max_bytes_),
        heading_(std::move(other.heading_)),
        file_(std::exchange(other.file_, -1)),
        bytes_(other.bytes_),
        is_torn_(other.is_torn_) {}
  RotatedFile& operator=(RotatedFile&&) = delete;

  /// Appends a line, which ends with its '\n'.
  void append(std::string_view line);

  static std::filesystem::path older_of(const std::filesystem::path& file);

 private:
  RotatedFile(std::filesystem::path file, std::uintmax_t max_bytes, Heading heading)
      : path_(std::move(file)), max_bytes_(max_bytes), heading_(std::move(heading)) {}
  Status begin(int flags);
  void write(std::string_view text);

  std::filesystem::path path_;
  std::uintmax_t max_bytes_;
  Heading heading_;
  int file_ = -1;
  std::uintmax_t bytes_ = 0;
  bool is_torn_ = false;  // the last line is not whole
};

}  // namespace tutti::program
