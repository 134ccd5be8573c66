// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iterator>
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
int list_operators(const lab::MissionDocs& docs) {
  for (const auto& [key, meaning] : mission::operator_settings())
    if (const auto field = std::ranges::find(docs.product, key, &FieldDoc::path); field != docs.product.end())
      fmt::print("{}", words_of(*field, meaning));
  fmt::print(
      "These are what an operator sets; tutti settings --all lists all {}, --simulation the {} with which robots are "
      "simulated,\nand tutti settings WORD what contains it.\n",
      docs.product.size(), docs.laboratory.size());
  return 0;
}

/// Those that have all these words in their key or meaning.
int list(const std::vector<FieldDoc>& fields, const std::vector<std::string>& words) {
  std::size_t shown = 0;
  for (const auto& field : fields) {
    const auto contains = [&](const std::string& word) {
      return field.path.find(word) != std::string::npos || field.help.find(word) != std::string::npos;
    };
    if (!std::ranges::all_of(words, contains)) continue;
    fmt::print("{}", words_of(field, field.help));
    ++shown;
  }
  if (shown > 0) return 0;
  return complain("settings", fmt::format("no key or meaning contains '{}'; --all and --simulation list all",
                                          fmt::join(words, "' and '")));
}

struct SettingsOptions {
  std::vector<std::string> words;
  bool all = false, simulation = false;
  std::string program;
};

int run(const SettingsOptions& options) {
  if (options.program == "server") return list(document_config(program::ServerSettings()), options.words);
  if (options.program == "robot") return list(document_config(program::RobotSettings()), options.words);
  if (options.program == "worker") return list(document_config(program::WorkerSettings()), options.words);
  lab::MissionDocs docs = lab::document_mission();
  if (options.words.empty() && !options.all && !options.simulation) return list_operators(docs);
  const bool searches_all = options.all == options.simulation;  // neither: a word is looked for in both
  std::vector<FieldDoc> fields;
  if (options.all || searches_all) std::ranges::move(docs.product, std::back_inserter(fields));
  if (options.simulation || searches_all) std::ranges::move(docs.laboratory, std::back_inserter(fields));
  return list(fields, options.words);
}

}  // namespace

void add_settings_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SettingsOptions>();
  auto* command = app.add_subcommand(
      "settings", "List what an operator sets: key, default, bounds and meaning; --all, --simulation: everything.");
  command->footer(
      "A mission file sets them as YAML, tutti run with --set KEY=VALUE; robots[] stands for robots[0], robots[1], "
      "...\n"
      "All settings of one mission: tutti run MISSION.yaml --print-config\n"
      "Example: tutti settings agreement\n");
  command
      ->add_option("word", options->words, "Only what has this in its key or meaning; of several words, all of them.")
      ->type_name("WORD");
  command->add_flag("--all", options->all, "All that recordings and live robots have, not only what an operator sets");
  command->add_flag("--simulation", options->simulation,
                    "Settings that simulate robots, and spoil what they measure, find or say");
  command->add_option("--of", options->program, "All that a server, a robot or a worker knows of a mission file")
      ->type_name("PROGRAM")
      ->check(CLI::IsMember({"server", "robot", "worker"}));
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace tutti::app
