// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "tutti/base/result.hpp"

namespace tutti::program {

/// The folder of one server or robot, which has everything that it knows and is not shared with a second program. The
/// file `owner` in it states whose it is, and since when.
class StateFolder {
 public:
  /// Opens the folder, and makes it if it is missing. Also sets the program's umask, so that files made from then on
  /// have at most mode 0640 and folders 0750. `owner` is "server" or "robot NAME"; `brought` is a file that somebody
  /// may have put into a new folder, such as a store. Fails when another program has the folder open, when it has
  /// another owner or other contents, or when the disk fails.
  static Result<StateFolder> open(const std::filesystem::path& folder, const std::string& owner,
                                  const std::string& brought = "");
  ~StateFolder();
  StateFolder(StateFolder&& other) noexcept
      : path_(std::move(other.path_)),
        made_ns_(other.made_ns_),
        is_new_(other.is_new_),
        lock_(std::exchange(other.lock_, -1)) {}
  StateFolder& operator=(StateFolder&&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// When the folder was made, in nanoseconds since the Unix epoch; used as a robot's session and as a map's epoch.
  [[nodiscard]] std::uint64_t made_ns() const { return made_ns_; }
  /// Wall seconds since it was made.
  [[nodiscard]] double age_s() const;
  [[nodiscard]] bool is_new() const { return is_new_; }  ///< Made by this open().

 private:
  explicit StateFolder(std::filesystem::path path) : path_(std::move(path)) {}
  [[nodiscard]] Status lock();
  [[nodiscard]] Status read_or_make(const std::string& owner, const std::string& brought);

  std::filesystem::path path_;
  std::uint64_t made_ns_ = 0;
  bool is_new_ = false;
  int lock_ = -1;
};

}  // namespace tutti::program
