// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "commands.hpp"
#include "options.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/mission/operator_settings.hpp"
#include "tutti/program/robot_program.hpp"
#include "tutti/program/server_program.hpp"
#include "tutti/program/worker_program.hpp"

namespace tutti::app {
namespace {

using config_internal::FieldDoc;

std::string words_of(const FieldDoc& field, std::string_view meaning) {
  std::string out = field.path;
  if (!field.default_value.empty()) out += " = " + field.default_value;
  out += fmt::format("   ({}{}{})\n", field.type, field.range.empty() ? "" : ", ", field.range);
  return meaning.empty() ? out : out + fmt::format("    {}\n", meaning);
}

/// The operator's settings, in their own words.
void list_operators(const std::vector<FieldDoc>& fields) {
  for (const auto& [key, meaning] : mission::operator_settings())
    if (const auto field = std::ranges::find(fields, key, &FieldDoc::path); field != fields.end())
      fmt::print("{}", words_of(*field, meaning));
  fmt::print(
      "These are what an operator sets; tutti settings --all lists all {}, tutti settings WORD what contains it.\n",
      fields.size());
}

/// A program's, or, without one, a whole mission's with all that is simulated and measured in it.
std::vector<FieldDoc> settings_of(const std::string& program) {
  if (program == "server") return document_config(program::ServerSettings());
  if (program == "robot") return document_config(program::RobotSettings());
  if (program == "worker") return document_config(program::WorkerSettings());
  return lab::document_mission();
}

int run(const std::vector<std::string>& parts, bool all, const std::string& program) {
  const auto fields = settings_of(program);
  if (parts.empty() && !all && program.empty()) {
    list_operators(fields);
    return 0;
  }
  std::size_t shown = 0;
  for (const auto& field : fields) {
    const auto contains = [&](const std::string& part) {
      return field.path.find(part) != std::string::npos || field.help.find(part) != std::string::npos;
    };
    if (!std::ranges::all_of(parts, contains)) continue;
    fmt::print("{}", words_of(field, field.help));
    ++shown;
  }
  if (shown > 0) return 0;
  return complain("settings",
                  fmt::format("no key or meaning contains '{}'; --all lists all", fmt::join(parts, "' and '")));
}

}  // namespace

void add_settings_command(CLI::App& app, int& exit_code) {
  const auto parts = std::make_shared<std::vector<std::string>>();
  const auto all = std::make_shared<bool>(false);
  auto* command = app.add_subcommand(
      "settings", "List what an operator sets: key, default, bounds and meaning; --all: all there is to set.");
  command->footer(
      "A mission file sets them as YAML, tutti run with --set KEY=VALUE; robots[] stands for robots[0], robots[1], "
      "...\n"
      "What one mission has: tutti run MISSION.yaml --print-config\n"
      "Example: tutti settings agreement\n");
  command->add_option("word", *parts, "Only what has this in its key or meaning; of several words, all of them.")
      ->type_name("WORD");
  command->add_flag("--all", *all, "Not only what an operator sets.");
  const auto program = std::make_shared<std::string>();
  command->add_option("--of", *program, "All that a server, a robot or a worker knows of a mission file")
      ->type_name("PROGRAM")
      ->check(CLI::IsMember({"server", "robot", "worker"}));
  command->callback([parts, all, program, &exit_code] { exit_code = run(*parts, *all, *program); });
}

}  // namespace tutti::app
