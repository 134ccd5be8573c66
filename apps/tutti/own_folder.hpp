// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdlib.h>  // NOLINT(modernize-deprecated-headers): mkdtemp

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>
#include <utility>

#include "tutti/base/result.hpp"

namespace tutti::app {

/// A folder that nobody had before; it goes when this does, with all that is in it, and nothing else goes.
class OwnFolder {
 public:
  /// "<parent>/.<name>-XXXXXX"; the parent must exist.
  static Result<std::unique_ptr<OwnFolder>> make(const std::filesystem::path& parent, const std::string& name) {
    std::string path = (parent / ("." + name + "-XXXXXX")).string();
    if (mkdtemp(path.data()) == nullptr)
      return fail(ErrorCode::io, "{}: cannot make a folder in it: {}", parent.string(), std::strerror(errno));
    return std::unique_ptr<OwnFolder>(new OwnFolder(path));
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  ~OwnFolder() {
    std::error_code nobody_is_left_to_tell;
    std::filesystem::remove_all(path_, nobody_is_left_to_tell);
  }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  explicit OwnFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

}  // namespace tutti::app
