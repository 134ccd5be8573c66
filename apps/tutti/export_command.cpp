// SPDX-License-Identifier: BSD-3-Clause
// tutti export: what a mission or a map has come to, for other programs. The formats are a table (exports/formats.hpp).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "options.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/exports/formats.hpp"

namespace tutti::app {
namespace {

using exports::Format;

struct ExportOptions {
  std::string input;
  bool live = false;
  std::vector<std::string> outputs;
  std::map<std::string_view, std::string> by_name;  ///< The options that name a format.
  exports::FormatSettings settings;
};

/// Adds an option for each field that describe() lists.
struct AddOptions {
  CLI::App& command;
  template <class Number>
  void field(const std::string& name, Number& value, const Bound& bound, const std::string& help) {
    add_number(command, "--" + name, value, help, "M",
               std::isfinite(bound.high) ? within(bound.low, bound.high) : finite(!bound.low_open));
  }
};

std::string names_of_options() {
  std::string out;
  for (const Format& format : exports::all_formats()) out += fmt::format(", --{}", format.name);
  return out;
}

using Wanted = std::vector<std::pair<const Format*, std::string>>;

Result<Wanted> wanted_of(const ExportOptions& options, bool is_folder) {
  Wanted out;
  for (const std::string& file : options.outputs) {
    const auto format = exports::format_of(file);
    if (!format) return tl::unexpected(format.error());
    out.emplace_back(*format, file);
  }
  for (const Format& format : exports::all_formats())
    if (const std::string& file = options.by_name.at(format.name); !file.empty()) out.emplace_back(&format, file);
  if (out.empty()) return fail(ErrorCode::configuration, "nothing to write: expected -o FILE{}", names_of_options());
  for (const auto& [format, file] : out)
    if (is_folder && format->of_run == nullptr)
      return fail(ErrorCode::configuration,
                  "{}: is made of a map's file, and {} is a folder; tutti run --map FILE writes the map", file,
                  options.input);
  return out;
}

Status export_all(const ExportOptions& options) {
  std::error_code failure;
  const bool is_folder = std::filesystem::is_directory(options.input, failure);
  const auto wanted = wanted_of(options, is_folder);
  if (!wanted) return tl::unexpected(wanted.error());
  exports::MapSource map;
  if (!is_folder) {
    auto opened = exports::open_map(options.input, options.live);
    if (!opened) return tl::unexpected(opened.error());
    map = std::move(*opened);
    if (!map.why_copied.empty()) fmt::print("note: {}: a copy of it is read, as with --live\n", map.why_copied);
    if (map.estimate.components > 1)
      fmt::print("note: {} components, of which each has a frame of its own\n", map.estimate.components);
  }
  for (const auto& [format, file] : *wanted) {
    if (auto made = make_folder_of(file); !made) return made;
    const auto report =
        is_folder ? format->of_run(options.input, options.settings, file) : format->of_map(map, options.settings, file);
    if (!report) return tl::unexpected(report.error());
    fmt::print("{}\n", *report);
  }
  return {};
}

}  // namespace

void add_export_command(CLI::App& parent, int& exit_code) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* command = parent.add_subcommand("export", "Write what a mission or a map has come to for other programs.");
  command->add_option("input", options->input, "A folder that tutti run has written, or a map's file.")
      ->type_name("IN")
      ->required();
  command->add_flag(
      "--live", options->live,
      "A server may open the map meanwhile: it is copied to the folder for temporary files (TMPDIR) first, and neither "
      "changed nor locked. A map that a server has open is always read so.");
  command->add_option("-o,--output", options->outputs, "Where to write it; the ending says in which format.")
      ->type_name("FILE");
  for (const Format& format : exports::all_formats())
    command
        ->add_option(fmt::format("--{}", format.name), options->by_name[format.name],
                     fmt::format("{}{}", format.help, format.of_run == nullptr ? "\nOnly of a map's file." : ""))
        ->type_name(format.ending == "/" ? "DIR/" : fmt::format("FILE{}", format.ending));
  command->add_flag(
      "--ros-only", options->settings.ros_only,
      "In .mcap nothing but ROS's messages, as rosbag2 plays it: what else is JSON is diagnostics there.");
  AddOptions add{*command};
  options->settings.describe(add);
  command->footer(
      "Example: tutti run missions/demo.yaml --out out/demo && tutti export out/demo -o demo.mcap\n"
      "A map to drive on, of a running server: tutti export state/map.tutti --live -o map.yaml\n");
  command->callback([options, command, &exit_code] {
    const auto done = export_all(*options);
    const bool is_alias = command->get_parent()->get_name() == "map";
    if (!done)
      exit_code = complain(is_alias ? "map export" : "export", done.error().message,
                           done.error().code == ErrorCode::configuration ? 2 : 1);
  });
}

}  // namespace tutti::app
