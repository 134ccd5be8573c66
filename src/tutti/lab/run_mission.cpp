// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/run_mission.hpp"

#include <string>
#include <utility>
#include <vector>

#include "tutti/lab/closure_verifiers.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/lab/shadows.hpp"
#include "tutti/mission/robot_alone.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"

namespace tutti::lab {

namespace {

/// The input with clocks and poses of LiDARs set to what robots alone say of them, if `config` asks for it; a second
/// time, because scans were deskewed by odometry of the wrong time or place before.
Result<mission::MissionInput> corrected_input(MissionConfig& config, const mission::RunOptions& options) {
  constexpr int kTimes = 2;
  auto input = load_input(config, options.data, options.seed);
  std::vector<std::string> said;
  for (int k = 0; k < kTimes && input && config.agent.submap.fit.scans == "correct"; ++k) {
    std::vector<std::string> changes = mission::correct_robots(input->robots, config);
    if (changes.empty()) break;
    said.insert(said.end(), changes.begin(), changes.end());
    input = load_input(config, options.data, options.seed);
  }
  if (input && !input->robots.empty())
    input->robots.front().warnings.insert(input->robots.front().warnings.end(), said.begin(), said.end());
  return input;
}

}  // namespace

Result<mission::MissionRecord> run_mission(const MissionConfig& given, mission::RunOptions options) {
  MissionConfig config = given;
  auto input = corrected_input(config, options);
  if (!input) return tl::unexpected(input.error());
  for (mission::MissionRecording& robot : input->robots) robot.recording.robot.value += options.map.free_robot.value;
  options.settings_yaml = to_yaml(config);
  mission::MissionParts parts{.input = std::move(*input),
                              .verifier = nullptr,
                              .refiner = verifiers::make_refiner(config.closures, config.refinement),
                              .companions = [&config, &options](const Recording& recording) {
                                return make_shadows(recording, config.agent, config.compare_policies, options.seed);
                              }};
  parts.verifier = make_closure_verifier(config, parts.input.robots, options.seed);
  return mission::run_mission(config, std::move(parts), options);
}

}  // namespace tutti::lab
