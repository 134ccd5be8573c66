// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <vector>

namespace CLI {
class App;
}

/// The program's table of commands, as a person's command line meets it.
namespace tutti::app {

/// The commands below `app` that --help lists, in its order.
std::vector<const CLI::App*> shown_commands(const CLI::App& app);

/// The command that a command line names.
struct NamedCommand {
  const CLI::App* command = nullptr;
  std::string path;        ///< "tutti map closure"
  std::string no_command;  ///< The first argument that is none although only a command can be there; empty: all fit.
};
/// Follows the arguments down to the first that is an option, or an argument of a command.
NamedCommand named_command(const CLI::App& program, std::span<const std::string> line);
/// "'expotr' is no command of tutti; did you mean 'tutti export'?"
std::string no_such_command(const NamedCommand& named);

/// Every option of every command takes one value each time it is given, and what stands behind that is an argument of
/// the command. CLI11 gives an option with a list of values all words up to the next option.
void take_one_value_each(CLI::App& program);

/// Adds `help` and `version`, which people type before they know of --help.
void add_help_and_version_commands(CLI::App& program, int& exit_code);

}  // namespace tutti::app
