// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::lab {

/// Programs that this one has started. They are asked to end when this program ends, even if it is killed
/// (end_with_parent()).
class Children {
 public:
  Children() = default;
  ~Children() { stop_all(); }
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;

  /// Starts a program. `command` is the program and its arguments; its output goes to the file `output`.
  Status start(const std::string& name, std::vector<std::string> command, const std::filesystem::path& output);
  /// Fails when a program has ended, with the end of its output.
  Status check();
  /// Sends SIGTERM, then SIGKILL to those still running after 30 s. Returns when they have ended.
  void stop(const std::vector<std::string>& names);
  void stop_all();

 private:
  struct Child {
    pid_t pid = -1;
    std::filesystem::path output;
  };
  std::map<std::string, Child> running_;
};

}  // namespace tutti::lab
