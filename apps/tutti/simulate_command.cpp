// SPDX-License-Identifier: BSD-3-Clause
// tutti simulate: a simulated mission as bags.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "commands.hpp"
#include "options.hpp"
#include "progress_line.hpp"
#include "tutti/lab/break_recording.hpp"
#include "tutti/lab/write_bags.hpp"
#include "tutti/program/stop.hpp"

namespace tutti::app {
namespace {

struct SimulateOptions {
  std::string mission, folder;
  std::uint64_t seed = 1;
  std::vector<std::string> assignments, mistakes;
};

/// Settings for mistakes that are given as ROBOT=KIND.
Result<std::vector<std::string>> with_mistakes(std::vector<std::string> assignments,
                                               const std::vector<std::string>& mistakes) {
  std::vector<std::string> rows;
  for (const std::string& mistake : mistakes) {
    const std::size_t at = mistake.find('=');
    if (at == std::string::npos || at == 0)
      return fail(ErrorCode::configuration, "--break '{}', expected ROBOT=KIND, such as bravo=scans_late", mistake);
    rows.push_back(fmt::format("{{robot: \"{}\", kind: \"{}\"}}", mistake.substr(0, at), mistake.substr(at + 1)));
  }
  if (!rows.empty()) assignments.push_back(fmt::format("mistakes=[{}]", fmt::join(rows, ", ")));
  return assignments;
}

bool is_cut(const lab::WrittenBag& bag) { return program::stop_asked() && bag.duration_s < bag.planned_s; }

int simulate(const SimulateOptions& options) {
  const auto assignments = with_mistakes(options.assignments, options.mistakes);
  if (!assignments) return complain("simulate", assignments.error().message, 2);
  const auto config = lab::load_mission(options.mission, *assignments);
  if (!config) return complain("simulate", config.error().message, 2);
  ProgressLine line;
  const lab::Watch watch{
      .progress = [&](const std::string& robot,
                      double share) { line.show(share, fmt::format("{:4.0f} %   {}", 100.0 * share, robot)); },
      .stop = announced_stop("the bags are closed with what is there")};
  const auto bags = lab::write_bags(*config, options.seed, options.folder, watch);
  line.close();
  if (!bags) return complain("simulate", bags.error().message, bags.error().code == ErrorCode::configuration ? 2 : 1);
  for (const lab::WrittenBag& bag : *bags)
    fmt::print("{}: {} messages{}\n", bag.folder, bag.messages,
               is_cut(bag) ? fmt::format(", stopped at {:.0f} of {:.0f} s", bag.duration_s, bag.planned_s) : "");
  if (program::stop_asked())
    fmt::print("stopped: {} bags are there, each readable; robots that are not among them were not begun\n",
               bags->size());
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
      "Ctrl-C or SIGTERM ends it: the bag is closed, and can be read up to there.\n"
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
  command
      ->add_option("--break", options->mistakes,
                   "Set a robot up wrongly, or let its odometry fail, to see what tutti says: " +
                       help_of(lab::robot_mistakes()) + ". May be given several times.")
      ->type_name("ROBOT=KIND");
  command->callback([options, &exit_code] { exit_code = simulate(*options); });
}

}  // namespace tutti::app
