// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "tutti/base/result.hpp"

namespace tutti::program {

/// The folder of one server or robot: all that it knows, and what it does not share with a second program. The file
/// `owner` in it says whose it is and since when.
class StateFolder {
 public:
  /// Made if it is missing. `owner`: "server", "robot NAME". Errors: another program has it open; it is another
  /// owner's; it holds other things; the disk. `brought`: a store that somebody may have put into a new one.
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
  /// When it was made, nanoseconds since the Unix epoch: the number of a robot's session and of a map's epoch.
  [[nodiscard]] std::uint64_t made_ns() const { return made_ns_; }
  /// Wall seconds since then.
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

/// Written beside and put in its place, so that a reader sees all of the old or all of the new.
Status replace_file(const std::filesystem::path& file, const std::string& text, bool durable);

}  // namespace tutti::program
