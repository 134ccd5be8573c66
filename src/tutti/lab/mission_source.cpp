// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/mission_source.hpp"

#include <algorithm>
#include <utility>

#include "tutti/base/config_io.hpp"
#include "tutti/bus/transport.hpp"
#include "tutti/lab/closure_verifiers.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/lab/update_json.hpp"
#include "tutti/mapfile/known_map.hpp"
#include "tutti/mission/evaluate.hpp"
#include "tutti/mission/localise_mission.hpp"
#include "tutti/mission/runner.hpp"
#include "tutti/simulation/recordings.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"

namespace tutti::lab {

Result<MissionConfig> load(const MissionSource& source) {
  if (!source.file.empty()) return load_mission(source.file, source.assignments);
  auto root = parse_yaml("{}", "settings");
  if (!root) return tl::unexpected(root.error());
  for (const std::string& assignment : source.assignments)
    if (const auto ok = apply_override(*root, assignment); !ok) return tl::unexpected(ok.error());
  auto config = read_mission(*root, "--set");
  if (config && config->closure_changes.come_with_mission())
    return fail(ErrorCode::configuration, "closures.verifier is '{}': without a mission there is none",
                config->closure_changes.verifier);
  return config;
}

bool is_named(const MissionSource& source) { return !source.name.empty() || !source.file.empty(); }

Result<std::string> name_on_bus(const MissionSource& source, const MissionConfig& config) {
  std::string name = source.name;
  const bool is_in_file = name.empty() && config.mission != MissionConfig{}.mission;
  if (is_in_file) name = config.mission;
  if (name.empty()) return bus::kDefaultMission;
  if (auto ok = bus::check_mission_name(name); !ok)
    return fail(ErrorCode::configuration, "{}{}", ok.error().message,
                is_in_file ? "; that is what the mission file calls it, --mission NAME gives another name" : "");
  return name;
}

std::vector<std::string> robot_names(const MissionConfig& config) {
  std::vector<std::string> names;
  if (config.source == "recordings")
    for (const mission::RobotConfig& robot : config.robots) names.push_back(robot.name);
  else if (config.source == "hall")
    for (const auto& robot : config.hall.robots) names.push_back(robot.name);
  else
    for (const auto& robot : simulation::single_robots(config.simulation.robots)) names.push_back(robot.name);
  return names;
}

Result<std::shared_ptr<const server::ClosureVerifier>> make_verifier(const MissionConfig& config,
                                                                     const MissionSource& source) {
  if (!config.closure_changes.come_with_mission()) return make_closure_verifier(config, {}, source.seed);
  const auto input = load_input(config, source.data, source.seed);
  if (!input) return tl::unexpected(input.error());
  return make_closure_verifier(config, input->robots, source.seed);
}

namespace {

/// The verifier is made here where it needs the mission.
Result<program::VerifierSettings> verifier_settings(const MissionConfig& config, const MissionSource& source) {
  program::VerifierSettings out{.closures = config.closures, .refinement = config.refinement, .other = {}};
  auto verifier = make_verifier(config, source);
  if (!verifier) return tl::unexpected(verifier.error());
  if ((*verifier)->settings().empty()) out.other = std::move(*verifier);
  return out;
}

}  // namespace

Result<program::ServerSettings> server_settings(const MissionSource& source) {
  const auto config = load(source);
  if (!config) return tl::unexpected(config.error());
  auto name = name_on_bus(source, *config);
  if (!name) return tl::unexpected(name.error());
  auto verifiers = verifier_settings(*config, source);
  if (!verifiers) return tl::unexpected(verifiers.error());
  program::ServerSettings out{.mission = std::move(*name),
                              .robots = {},
                              .accepts_others = !config->closure_changes.come_with_mission(),
                              .server = config->server,
                              .verifiers = std::move(*verifiers)};
  if (source.file.empty()) return out;
  out.robots = robot_names(*config);
  out.robot_arguments = source.file;
  return out;
}

Result<program::WorkerSettings> worker_settings(const MissionSource& source) {
  const auto config = load(source);
  if (!config) return tl::unexpected(config.error());
  auto verifiers = verifier_settings(*config, source);
  if (!verifiers) return tl::unexpected(verifiers.error());
  program::WorkerSettings out{.mission = {}, .verifiers = std::move(*verifiers)};
  if (!is_named(source)) return out;
  auto name = name_on_bus(source, *config);
  if (!name) return tl::unexpected(name.error());
  out.mission = std::move(*name);
  return out;
}

namespace {

/// Takes the file's settings of the robot's messages, if it is a robot with a recording.
Status fill_sensors(const MissionConfig& config, program::RobotOptions& options) {
  const auto robot = std::ranges::find(config.robots, options.name, &mission::RobotConfig::name);
  if (config.source != "recordings" || robot == config.robots.end()) return {};
  options.settings.with_images = config.closures.kind().uses_images;
  auto& [odometry, images] = options.settings.sensors;
  images.most_difference_s = config.tracking.max_stamp_difference_s;
  images.most_cameras = robot->images.most_cameras;
  images.time_offset_s = robot->images.time_offset_s;
  images.depth_sensor = robot->images.depth.sensor;
  images.most_depth_difference_s = robot->images.depth.max_difference_s;
  odometry.covariance = robot->covariance;
  odometry.scan_times = robot->scan_times_config();
  odometry.scan_offset_s = robot->scan_time_offset_s;
  odometry.p_body_antenna = robot->p_body_antenna();
  if (!mission::is_given(robot->T_body_lidar)) return {};
  const auto T_body_lidar = mission::to_pose(robot->T_body_lidar);
  if (!T_body_lidar) return in_context("robot " + robot->name, T_body_lidar.error());
  odometry.T_body_lidar = *T_body_lidar;
  return {};
}

Result<program::RobotSettings> settings_of_robot(const MissionSource& source, const MissionConfig& config) {
  auto name = name_on_bus(source, config);
  if (!name) return tl::unexpected(name.error());
  return program::RobotSettings{.mission = std::move(*name),
                                .robots = robot_names(config),
                                .agent = config.agent,
                                .tracking = config.tracking,
                                .sensors = {}};
}

}  // namespace

Result<program::RobotSettings> robot_settings(const MissionSource& source) {
  const auto config = load(source);
  if (!config) return tl::unexpected(config.error());
  return settings_of_robot(source, *config);
}

Result<std::shared_ptr<const localise::Localiser::Setup>> localise_setup(const MissionSource& source,
                                                                         const std::filesystem::path& map) {
  const auto config = load(source);
  if (!config) return tl::unexpected(config.error());
  auto opened = mapfile::open_known_map(map);
  if (!opened) return in_context("--map", opened.error());
  return mission::localise_setup(*config, config->agent.submap, std::move(opened->known),
                                 [closures = config->closures] { return verifiers::make_verifier(closures); });
}

Status fill_robot_options(const MissionSource& source, program::RobotOptions& options) {
  const auto config = load(source);
  if (!config) return tl::unexpected(config.error());
  auto settings = settings_of_robot(source, *config);
  if (!settings) return tl::unexpected(settings.error());
  options.settings = std::move(*settings);
  if (!options.feed.empty()) return fill_sensors(*config, options);
  const auto number = program::number_of(options.name, options.settings.robots, false);
  if (!number) return tl::unexpected(number.error());
  auto input = load_input(*config, source.data, source.seed);
  if (!input) return tl::unexpected(input.error());
  const double duration_s = mission::duration_of(*config, input->robots);
  const auto robot = std::make_shared<const mission::MissionRecording>(std::move(input->robots.at(number->value)));
  const auto score = [robot, policy = config->agent.policy.name, association = config->association](
                         const Trajectory& map, const robot::RobotAgent& agent) {
    mission::UpdateRecord update{.revision = agent.map_age().second};
    score_update({.recording = robot.get(), .default_policy = policy, .agents = {{policy, &agent}}}, map, association,
                 update);
    return to_json(update);
  };
  options.replay = {
      .recording = {robot, &robot->recording}, .start_s = robot->start_s, .duration_s = duration_s, .score = score};
  return {};
}

}  // namespace tutti::lab
