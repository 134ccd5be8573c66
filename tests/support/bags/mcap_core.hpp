// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "support/paths.hpp"

/// The independent reader of what we write: node with @mcap/core, of npm. Nothing of it is needed to build or to run.
namespace tutti::bags::test {

inline constexpr const char* kNoMcapCore =
    "needs node, and @mcap/core, fzstd, @foxglove/rosmsg and @foxglove/rosmsg2-serialization of npm below the folder "
    "that TUTTI_NODE_MODULES names";

/// A line per message: "TOPIC STAMP JSON"; a last one "error: .." if the file is not as it should be. Nothing where
/// node or its libraries are not there.
inline std::optional<std::vector<std::string>> read_with_mcap_core(const std::string& path) {
  const std::string script = ::tutti::test::source_path("tests/support/bags/read_with_mcap_core.cjs").string();
  FILE* pipe = popen(("node '" + script + "' '" + path + "' 2>&1").c_str(), "r");
  if (pipe == nullptr) return std::nullopt;
  std::string text;
  std::array<char, 4096> buffer{};
  for (std::size_t got = 0; (got = fread(buffer.data(), 1, buffer.size(), pipe)) > 0;) text.append(buffer.data(), got);
  const int status = pclose(pipe), code = WIFEXITED(status) ? WEXITSTATUS(status) : 1;
  constexpr int kNoNode = 127, kNoLibraries = 77;
  if (code == kNoNode || code == kNoLibraries) return std::nullopt;
  std::vector<std::string> out;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) out.push_back(line);
  if (code != 0) out.push_back("error: exit code " + std::to_string(code));
  return out;
}

}  // namespace tutti::bags::test
