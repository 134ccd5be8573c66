// SPDX-License-Identifier: BSD-3-Clause
// tutti export: what a mission or a map has come to, for viewers of robots' recordings.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "commands.hpp"
#include "options.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/exports/map_scene.hpp"
#include "tutti/exports/run_scene.hpp"

namespace tutti::app {
namespace {

struct SceneOptions {
  std::string input, output;
};

Result<exports::Scene> scene_of(const std::string& input) {
  std::error_code failure;
  if (std::filesystem::is_directory(input, failure)) return exports::scene_of_run(input);
  const auto map = mapfile::open(input);
  if (!map) return tl::unexpected(map.error());
  const auto content = mapfile::read(**map);
  if (!content) return tl::unexpected(content.error());
  return exports::scene_of_map(**map, *content, mapfile::estimate(*content));
}

int export_scene(const SceneOptions& options) {
  const auto scene = scene_of(options.input);
  if (!scene) return complain("export", scene.error().message);
  if (auto made = make_folder_of(options.output); !made) return complain("export", made.error().message);
  const auto written = exports::write_scene(*scene, options.output);
  if (!written) return complain("export", written.error().message);
  fmt::print("{}: {} messages of {} topics\n", options.output, written->messages, written->topics);
  return 0;
}

}  // namespace

void add_export_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SceneOptions>();
  auto* command =
      app.add_subcommand("export", "Write what a mission or a map has come to as one MCAP file, for viewers.");
  command->footer(
      "Foxglove, Rerun and PlotJuggler open it: ways (nav_msgs/Path, and poses over time), /tf, the map's cloud,\n"
      "closures (markers by their state; from a map file with those refused, and why), alerts (/diagnostics), and as\n"
      "JSON each closure and how far odometry and correction are from the server's way. docs/report.md has the "
      "topics.\n"
      "Example: tutti run missions/demo.yaml --out out/demo && tutti export out/demo -o demo.mcap\n");
  command->add_option("input", options->input, "A folder that tutti run has written, or a map's file.")
      ->type_name("OUT")
      ->required();
  command->add_option("-o,--output", options->output, "Where to write it.")->type_name("FILE.mcap")->required();
  command->callback([options, &exit_code] { exit_code = export_scene(*options); });
}

}  // namespace tutti::app
