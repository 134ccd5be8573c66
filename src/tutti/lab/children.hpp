// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::lab {

/// Programs started by this one. They are asked to end when it ends, however that is (end_with_parent()).
class Children {
 public:
  Children() = default;
  ~Children() { stop_all(); }
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;

  /// `words`: the program and its arguments; what it prints goes to the file `output`.
  Status start(const std::string& name, std::vector<std::string> words, const std::filesystem::path& output);
  /// An error when one has ended, with the end of what it printed.
  Status check();
  /// SIGTERM, and SIGKILL to those that run on for 30 s. Returns when they have ended.
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
