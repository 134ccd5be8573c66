// SPDX-License-Identifier: BSD-3-Clause
#include "command_words.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "tutti/base/nearest_word.hpp"

namespace tutti::app {
namespace {

std::vector<std::string> names_of_commands(const CLI::App& app) {
  std::vector<std::string> out;
  for (const CLI::App* command : shown_commands(app)) out.push_back(command->get_name());
  return out;
}

}  // namespace

std::vector<const CLI::App*> shown_commands(const CLI::App& app) {
  return app.get_subcommands(
      [](const CLI::App* command) { return !command->get_name().empty() && !command->get_group().empty(); });
}

NamedCommand named_command(const CLI::App& program, std::span<const std::string> line) {
  NamedCommand out{.command = &program, .path = program.get_name(), .no_command = {}};
  for (const std::string& argument : line) {
    const auto commands = shown_commands(*out.command);
    if (commands.empty() || argument.starts_with('-')) break;
    const auto found =
        std::ranges::find(commands, argument, [](const CLI::App* command) { return command->get_name(); });
    if (found == commands.end()) {
      out.no_command = argument;
      break;
    }
    out.command = *found;
    out.path += " " + argument;
  }
  return out;
}

std::string no_such_command(const NamedCommand& named) {
  const auto names = names_of_commands(*named.command);
  const auto nearest = nearest_word(named.no_command, names);
  return fmt::format("'{}' is no command of {}{}", named.no_command, named.path,
                     nearest ? fmt::format("; did you mean '{} {}'?", named.path, *nearest)
                             : fmt::format(", expected one of {}", fmt::join(names, ", ")));
}

void take_one_value_each(CLI::App& program) {
  for (CLI::Option* option : program.get_options())
    if (option->nonpositional() && option->get_allow_extra_args())
      option->expected(1)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)->allow_extra_args(false);
  for (CLI::App* command : program.get_subcommands({})) take_one_value_each(*command);
}

void add_help_and_version_commands(CLI::App& program, int& exit_code) {
  program.add_subcommand("version", "Print this program's version, as --version does")->callback([&exit_code] {
    fmt::print("{}\n", TUTTI_VERSION);
    exit_code = 0;
  });
  CLI::App* help = program.add_subcommand("help", "What --help says of the program, or of a command");
  const auto line = std::make_shared<std::vector<std::string>>();
  help->add_option("command", *line, "As it is typed, e.g. map export")->type_name("COMMAND");
  help->callback([&program, line, &exit_code] {
    const NamedCommand named = named_command(program, *line);
    if (!named.no_command.empty()) {
      fmt::print(stderr, "tutti help: {}\n", no_such_command(named));
      exit_code = 2;
      return;
    }
    // App::help() would be that of the command which was typed, and so of `help`.
    fmt::print("{}", program.get_formatter()->make_help(named.command, named.path, CLI::AppFormatMode::Normal));
    exit_code = 0;
  });
}

}  // namespace tutti::app
