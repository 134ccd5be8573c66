// SPDX-License-Identifier: BSD-3-Clause
// A whole mission as programs: mission up.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "commands.hpp"
#include "live_mission.hpp"
#include "options.hpp"
#include "program_options.hpp"
#include "tutti/lab/mission_up.hpp"
#include "tutti/mission/report/report.hpp"

namespace tutti::app {

namespace fs = std::filesystem;

Status run_as_programs(lab::MissionUpOptions& options, program::Level console) {
  std::error_code error;
  options.program = fs::read_symlink("/proc/self/exe", error);
  options.version = TUTTI_VERSION;
  if (options.out.empty()) options.out = fs::path("out") / fs::path(options.mission.file).stem();
  const auto log = program::EventLog::on_console("mission", console);
  options.progress = [&](const std::string& line) { log->show(line); };
  const auto record = lab::mission_up(options, program::stop_asked());
  log->show("");
  if (!record) return tl::unexpected(record.error());
  if (auto ok = mission::write_report(*record, options.out.string()); !ok) return ok;
  fmt::print("{}", mission::report_text(*record, (options.out / "report.html").string()));
  return {};
}

void add_mission_command(CLI::App& app, int& exit_code) {
  CLI::App* group = app.add_subcommand("mission", "A mission as separate programs: see tutti mission up --help");
  group->require_subcommand(1);
  const auto options = std::make_shared<lab::MissionUpOptions>();
  const auto common = std::make_shared<ProgramArguments>();
  CLI::App* command = group->add_subcommand("up",
                                            "Start server, robots and workers of a mission as programs of their own on "
                                            "this machine, which talk over NATS; wait until every robot has\n"
                                            "replayed its recording and heard the last map; stop them and write the "
                                            "same report as tutti run. What each program\n"
                                            "reported and stored is left in OUT/state.");
  add_mission_argument(*command, *common, "The mission, or 'demo'")->required();
  command
      ->add_option("-o,--out", options->out,
                   "Folder for report and state, made if missing; default: out/ and the mission's name")
      ->type_name("DIR");
  add_rate_option(*command, options->rate, "Times real time; what the machine does not keep up with comes later");
  command
      ->add_option("--workers", options->workers, "Programs that verify loop closures; 0 = the server does it itself")
      ->type_name("N")
      ->check(CLI::Range(0, 256))
      ->capture_default_str();
  command->add_option("--threads", options->threads, "Pairs verified at a time, in the server or in each worker")
      ->type_name("N")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command->add_flag("--pki", options->has_rights,
                    "With TLS, and a credential of `tutti pki` for each program (docs/security.md), in OUT/state/pki");
  command->add_option("--view", options->view, "Serve the server's page (tutti server --view)")
      ->type_name("[HOST:]PORT");
  add_program_options(*command, *common);
  command->callback([options, common, &exit_code] {
    options->mission = common->mission;
    program::Level console{};
    exit_code = run_program("mission up", *common, console, [&] { return run_as_programs(*options, console); });
  });
}

}  // namespace tutti::app
