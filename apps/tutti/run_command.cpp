// SPDX-License-Identifier: BSD-3-Clause
#include "run_command.hpp"

#include <CLI/CLI.hpp>
#include <memory>

#include "run_mission_command.hpp"

namespace tutti::app {

void add_run_command(CLI::App& app, int& exit_code) {
  struct Arguments : MissionArguments {
    std::filesystem::path mission;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "run",
      "Run a mission: replay (or simulate) its robots, join their maps on the server, send proxy graphs back,\n"
      "correct the robots, and write a report (report.html, report.json, trajectories, graph, map).\n"
      "The same mission, data and seed give the same report.json.");
  command->add_option("mission", arguments->mission, "Mission file")->type_name("MISSION.yaml")->required();
  command->add_option("--data", arguments->data, "Folder that the mission's file names are relative to")
      ->type_name("DIR");
  add_mission_options(*command, *arguments);
  command->callback([arguments, &exit_code] {
    if (arguments->out.empty()) arguments->out = std::filesystem::path("out") / arguments->mission.stem();
    exit_code = run_and_report(mission::load_mission(arguments->mission, arguments->assignments), *arguments);
  });
}

}  // namespace tutti::app
