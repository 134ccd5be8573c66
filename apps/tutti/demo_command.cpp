// SPDX-License-Identifier: BSD-3-Clause
#include "demo_command.hpp"

#include <CLI/CLI.hpp>
#include <memory>

#include "run_mission_command.hpp"

namespace tutti::app {

void add_demo_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<MissionArguments>();
  arguments->out = std::filesystem::path("out") / "demo";
  CLI::App* command = app.add_subcommand(
      "demo",
      "See it work without any data: two simulated legged robots with LiDAR map a piece of tunnel for six minutes, "
      "with\n"
      "drifting odometry; loop closures are found from their scans. Takes about a minute and ends with a table and a\n"
      "report to look at.");
  add_mission_options(*command, *arguments);
  command->callback([arguments, &exit_code] {
    exit_code = run_and_report(mission::demo_mission(arguments->assignments), *arguments);
  });
}

}  // namespace tutti::app
