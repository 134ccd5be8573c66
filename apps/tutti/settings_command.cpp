// SPDX-License-Identifier: BSD-3-Clause
#include "settings_command.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "tutti/base/config_io.hpp"
#include "tutti/mission/mission_config.hpp"

namespace tutti::app {
namespace {

std::string words_of(const config_internal::FieldDoc& field) {
  std::string out = field.path;
  if (!field.default_value.empty()) out += " = " + field.default_value;
  out += fmt::format("   ({}{}{})\n", field.type, field.range.empty() ? "" : ", ", field.range);
  return field.help.empty() ? out : out + "    " + field.help + "\n";
}

int run(const std::vector<std::string>& parts) {
  const auto defaults = std::make_unique<const mission::MissionConfig>();
  std::size_t shown = 0;
  for (const auto& field : document_config(*defaults)) {
    const auto contains = [&](const std::string& part) { return field.path.find(part) != std::string::npos; };
    if (!std::ranges::all_of(parts, contains)) continue;
    fmt::print("{}", words_of(field));
    ++shown;
  }
  if (shown > 0) return 0;
  fmt::print(stderr, "tutti settings: no key contains '{}'; without an argument all are listed\n",
             fmt::join(parts, "' and '"));
  return 1;
}

}  // namespace

void add_settings_command(CLI::App& app, int& exit_code) {
  const auto parts = std::make_shared<std::vector<std::string>>();
  auto* command = app.add_subcommand("settings", "List what a mission can set: key, default, bounds and meaning.");
  command->footer(
      "A mission file sets them as YAML, tutti run with --set KEY=VALUE; robots[] stands for robots.0, robots.1, ...\n"
      "What one mission has: tutti run MISSION.yaml --print-config\n"
      "Example: tutti settings agreement\n");
  command->add_option("part", *parts, "Only keys that contain this; of several, all of them.")->type_name("PART");
  command->callback([parts, &exit_code] { exit_code = run(*parts); });
}

}  // namespace tutti::app
