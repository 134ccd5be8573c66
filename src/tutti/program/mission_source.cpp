// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/mission_source.hpp"

#include <algorithm>
#include <utility>

#include "tutti/base/config_io.hpp"
#include "tutti/bus/mission_lease.hpp"
#include "tutti/mission/closure_finders.hpp"
#include "tutti/simulation/recordings.hpp"

namespace tutti::program {

Result<mission::MissionConfig> load(const MissionSource& source) {
  std::error_code ignored;
  if (source.file == "demo" && !std::filesystem::exists("demo", ignored))
    return mission::demo_mission(source.assignments);
  if (!source.file.empty()) return mission::load_mission(source.file, source.assignments);
  auto root = parse_yaml("{}", "settings");
  if (!root) return tl::unexpected(root.error());
  for (const std::string& assignment : source.assignments)
    if (const auto ok = apply_override(*root, assignment); !ok) return tl::unexpected(ok.error());
  mission::MissionConfig config;
  if (const auto ok = load_config(*root, config, "--set"); !ok) return tl::unexpected(ok.error());
  if (config.closures.finder == "reference")
    return fail(ErrorCode::configuration, "closures.finder is 'reference': without a mission there is none");
  return config;
}

bool is_named(const MissionSource& source) { return !source.name.empty() || !source.file.empty(); }

Result<std::string> name_on_bus(const MissionSource& source, const mission::MissionConfig& config) {
  std::string name = source.name;
  const bool is_in_file = name.empty() && config.mission != mission::MissionConfig{}.mission;
  if (is_in_file) name = config.mission;
  if (name.empty()) return bus::NatsPortOptions{}.mission;
  if (auto ok = bus::check_mission_name(name); !ok)
    return fail(ErrorCode::configuration, "{}{}", ok.error().message,
                is_in_file ? "; that is what the mission file calls it, --mission NAME gives another name" : "");
  return name;
}

std::vector<std::string> robot_names(const mission::MissionConfig& config) {
  std::vector<std::string> names;
  if (config.source == "recordings")
    for (const mission::RobotConfig& robot : config.robots) names.push_back(robot.name);
  else if (config.source == "hall")
    for (const auto& robot : config.hall.robots) names.push_back(robot.name);
  else
    for (const auto& robot : simulation::single_robots(config.simulation.robots)) names.push_back(robot.name);
  return names;
}

/// FNV-1a of 32 bits, with the highest set.
RobotId robot_id_of(const std::string& name) {
  std::uint32_t hash = 2'166'136'261U;
  for (const char letter : name) hash = (hash ^ static_cast<unsigned char>(letter)) * 16'777'619U;
  return RobotId{hash | 0x8000'0000U};
}

Result<std::shared_ptr<const server::ClosureFinder>> make_finder(const mission::MissionConfig& config,
                                                                 const MissionSource& source) {
  if (config.closures.finder != "reference") return mission::make_closure_finder(config.closures, {}, source.seed);
  const auto input = mission::load_input(config, source.data, source.seed);
  if (!input) return tl::unexpected(input.error());
  return mission::make_closure_finder(config.closures, input->robots, source.seed);
}

Rng agent_randomness(std::uint64_t seed, const std::string& robot) { return Rng(seed).fork("agent/" + robot); }

double duration_of(const mission::MissionConfig& config, const std::vector<mission::MissionRecording>& recordings) {
  double duration_s = 0.0;
  for (const mission::MissionRecording& recording : recordings) {
    const Trajectory& odometry = recording.recording.odometry;
    duration_s = std::max(duration_s, recording.start_s + (odometry.back().stamp - odometry.front().stamp));
  }
  return config.duration_s > 0.0 ? std::min(duration_s, config.duration_s) : duration_s;
}

}  // namespace tutti::program
