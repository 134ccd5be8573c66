// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <string>

#include "options.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/stop.hpp"

namespace tutti::app {

/// Arguments of all programs that run until they are stopped.
struct ProgramArguments {
  lab::MissionSource mission;
  std::string log_level = "warning";
  bool print_config = false;
  int parent = 0;  ///< Process number of the program with which this one ends; 0: none.
};

inline CLI::Option* add_mission_argument(CLI::App& command, ProgramArguments& arguments, const std::string& what) {
  command.add_option("--data", arguments.mission.data, "Folder that the mission's file names are relative to")
      ->type_name("DIR");
  command.add_option("--seed", arguments.mission.seed, "Seed of everything random in a mission")
      ->type_name("N")
      ->check(whole_number())
      ->capture_default_str();
  command
      .add_option("--set", arguments.mission.assignments, "Change a setting of the mission; may be given several times")
      ->type_name("KEY=VALUE");
  return command.add_option("mission_file", arguments.mission.file, what)->type_name("MISSION.yaml");
}

inline void add_rate_option(CLI::App& command, double& rate, const std::string& what) {
  add_number(command, "--rate", rate, what, "R", within(1e-3, 1e6));
}

inline void add_program_options(CLI::App& command, ProgramArguments& arguments) {
  command
      .add_option("--log-level", arguments.log_level,
                  "What is reported on stderr: debug, info, warning or error; STATE/log.txt has all from info on")
      ->check(CLI::IsMember({"debug", "info", "warning", "error"}))
      ->type_name("LEVEL")
      ->capture_default_str();
  const auto print = [&command, &arguments] {
    arguments.print_config = true;
    for (CLI::Option* option : command.get_options()) option->required(false);
  };
  command.add_flag_callback("--print-config", print,
                            "Print every setting that this program has of a mission, with its value, and stop");
  command.add_option("--end-with-parent", arguments.parent, "")->group("");
}

/// Prints the settings for --print-config.
template <class Settings>
Status print_settings(const Settings& settings) {
  fmt::print("{}", to_yaml(dump_config(settings)));
  return {};
}

/// Calls `run`, which returns when it has ended or a signal has asked it to; returns the exit code.
inline int run_program(const char* name, const ProgramArguments& arguments, program::Level& console,
                       const std::function<Status()>& run) {
  const auto level = program::level_of(arguments.log_level);
  if (!level) return complain(name, level.error().message, 2);
  console = *level;
  program::stop_on_signals();
  if (arguments.parent > 0) program::end_with_parent(arguments.parent);
  const Status done = run();
  if (done) return 0;
  return complain(name, done.error().message, done.error().code == ErrorCode::configuration ? 2 : 1);
}

}  // namespace tutti::app
