// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tutti/mission/mission_config.hpp"

namespace CLI {
class App;
}

namespace tutti::app {

/// What `run` and `demo` share.
struct MissionArguments {
  std::filesystem::path data;
  std::filesystem::path out;
  std::uint64_t seed = 1;
  std::optional<double> rate;
  int threads = 0;
  std::vector<std::string> assignments;
  bool print_config = false;
};

/// Adds --out, --seed, --rate, --threads, --set and --print-config.
void add_mission_options(CLI::App& command, MissionArguments& arguments);

/// Runs, writes the report, prints the table. Returns the exit code.
int run_and_report(const Result<mission::MissionConfig>& config, const MissionArguments& arguments);

}  // namespace tutti::app
