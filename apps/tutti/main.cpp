// SPDX-License-Identifier: BSD-3-Clause
// One program, one thin file per subcommand.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "command_words.hpp"
#include "commands.hpp"

int main(int argc, char** argv) {
  CLI::App app{
      "tutti: collaborative robot mapping by spectral graph analysis.\n"
      "Several robots map the same place; a server joins their maps and sends back, in kilobytes, what each robot "
      "needs\n"
      "to agree with the joint map.\n\n"
      "Start here:   tutti demo\n"
      "Your mission: tutti run MISSION.yaml --data FOLDER     (docs/report.md explains what comes out)",
      "tutti"};
  app.footer("Exit codes: 0 fine, 1 the run failed, 2 usage or configuration is wrong.");
  app.require_subcommand(1);
  app.set_version_flag("--version", TUTTI_VERSION);
  app.get_formatter()->column_width(36);
  int exit_code = 0;
  tutti::app::add_demo_command(app, exit_code);
  tutti::app::add_run_command(app, exit_code);
  tutti::app::add_eval_command(app, exit_code);
  tutti::app::add_compare_command(app, exit_code);
  tutti::app::add_optimise_command(app, exit_code);
  tutti::app::add_map_command(app, exit_code);
  tutti::app::add_export_command(app, exit_code);
  tutti::app::add_bag_command(app, exit_code);
  tutti::app::add_settings_command(app, exit_code);
  tutti::app::add_status_command(app, exit_code);
  tutti::app::add_world_command(app, exit_code);
  tutti::app::add_simulate_command(app, exit_code);
  tutti::app::add_server_command(app, exit_code);
  tutti::app::add_robot_command(app, exit_code);
  tutti::app::add_worker_command(app, exit_code);
  tutti::app::add_page_command(app, exit_code);
  tutti::app::add_mission_command(app, exit_code);
  tutti::app::add_pki_command(app, exit_code);
  tutti::app::add_manual_command(app, exit_code);
  tutti::app::add_help_and_version_commands(app, exit_code);
  tutti::app::take_one_value_each(app);
  const std::vector<std::string> words(argv + 1, argv + std::max(argc, 1));
  if (const auto named = tutti::app::named_command(app, words); !named.no_command.empty()) {
    std::cerr << "tutti: " << tutti::app::no_such_command(named) << '\n';
    return 2;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int code = app.exit(error);
    return code == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::cerr << "tutti: internal error: " << error.what() << "\n(please report this with the command you ran)\n";
    return 1;
  }
  return exit_code;
}
