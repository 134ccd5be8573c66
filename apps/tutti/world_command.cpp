// SPDX-License-Identifier: BSD-3-Clause
#include "world_command.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "number_checks.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/simulation/surface.hpp"

namespace tutti::app {
namespace {

struct WorldOptions {
  std::string mission;
  std::string output;
  std::uint64_t seed = 1;
  double points_m = 0.0;
  std::vector<std::string> assignments;
};

int complain(int exit_code, const std::string& message) {
  fmt::print(stderr, "tutti world: {}\n", message);
  return exit_code;
}

int run(const WorldOptions& options) {
  const auto config = mission::load_mission(options.mission, options.assignments);
  if (!config) return complain(2, config.error().message);
  if (config->source != "simulation")
    return complain(2, fmt::format("{}: source is '{}', expected 'simulation'", options.mission, config->source));
  const auto mesh = simulation::world_mesh(config->simulation, options.seed);
  const Status written =
      options.points_m > 0.0
          ? formats::write_ply(options.output,
                               simulation::sample_surface(mesh, options.points_m, Rng(options.seed)).points)
          : formats::write_ply_mesh(options.output, mesh.vertices, mesh.triangles);
  if (!written) return complain(1, written.error().message);
  fmt::print("{}: {} triangles, world of {} with seed {}\n", options.output, mesh.triangles.size(), config->mission,
             options.seed);
  return 0;
}

}  // namespace

void add_world_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<WorldOptions>();
  auto* command =
      app.add_subcommand("world", "Write the world of a simulated mission as a PLY file, to look at or to survey.");
  command->footer(
      "The very walls that the simulated LiDAR sees with the same seed, in the frame of the reference trajectories.\n"
      "Example: tutti world missions/tunnel.yaml -o tunnel.ply\n");
  command->add_option("mission", options->mission, "Mission file with source: simulation.")
      ->required()
      ->type_name("MISSION.yaml");
  command->add_option("-o,--output", options->output, "Where to write it.")->required()->type_name("OUT.ply");
  command->add_option("--seed", options->seed, "As for tutti run.")->check(whole_number())->capture_default_str();
  command->add_option("--points", options->points_m, "Points about this far apart instead of a mesh, in metres.")
      ->check(within(1e-3, 1e3));
  command->add_option("--set", options->assignments, "Change a setting of the mission: key=value.")
      ->type_name("KEY=VALUE");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace tutti::app
