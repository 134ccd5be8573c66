// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "commands.hpp"
#include "manual.hpp"

namespace tutti::app {

void add_manual_command(CLI::App& app, int& exit_code) {
  const auto what = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand("manual", "All of --help as a page for man, or as a completion for bash.");
  command->footer("Example: tutti manual man | man -l -\n         source <(tutti manual bash)\n");
  command->add_option("form", *what, "What is written")
      ->type_name("FORM")
      ->check(CLI::IsMember({"man", "bash"}))
      ->required();
  command->callback([&app, what, &exit_code] {
    fmt::print("{}", *what == "man" ? manual_page(app, TUTTI_VERSION) : bash_completion(app));
    exit_code = 0;
  });
}

}  // namespace tutti::app
