// SPDX-License-Identifier: BSD-3-Clause
// tutti simulate: a simulated mission as bags.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "options.hpp"
#include "tutti/lab/write_bags.hpp"

namespace tutti::app {
namespace {

struct SimulateOptions {
  std::string mission, folder;
  std::uint64_t seed = 1;
  std::vector<std::string> assignments;
};

int simulate(const SimulateOptions& options) {
  const auto config = lab::load_mission(options.mission, options.assignments);
  if (!config) return complain("simulate", config.error().message, 2);
  const auto bags = lab::write_bags(*config, options.seed, options.folder,
                                    [](const std::string& robot) { fmt::print(stderr, "{} ..\n", robot); });
  if (!bags) return complain("simulate", bags.error().message, bags.error().code == ErrorCode::configuration ? 2 : 1);
  for (const lab::WrittenBag& bag : *bags) fmt::print("{}: {} messages\n", bag.folder, bag.messages);
  return 0;
}

}  // namespace

void add_simulate_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<SimulateOptions>();
  auto* command = app.add_subcommand(
      "simulate", "Write a simulated mission as ROS 2 bags, one a robot: what the robots would have recorded.");
  command->footer(
      "Each robot's bag is a folder of rosbag2's (MCAP) below DIR, with topics and frames below its name: odometry "
      "with\n"
      "covariances, LiDAR scans with the times of their points, IMU, images, /tf, /tf_static, and the true poses\n"
      "(/ROBOT/truth, in one frame `world` for all). Stamps count from 1 January 2026, as robots' clocks agree.\n"
      "Example: tutti simulate missions/demo.yaml -o bags && tutti bag info bags/alpha\n");
  command->add_option("mission", options->mission, "Mission file with source: simulation or hall, or 'demo'.")
      ->required()
      ->type_name("MISSION.yaml");
  command->add_option("-o,--output", options->folder, "Where the bags are made; theirs must not be there.")
      ->required()
      ->type_name("DIR");
  command->add_option("--seed", options->seed, "As for tutti run.")->check(whole_number())->capture_default_str();
  command->add_option("--set", options->assignments, "Change a setting of the mission: key=value.")
      ->type_name("KEY=VALUE");
  command->callback([options, &exit_code] { exit_code = simulate(*options); });
}

}  // namespace tutti::app
