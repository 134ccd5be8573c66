// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/recordings.hpp"

#include <array>
#include <optional>
#include <set>
#include <string>
#include <utility>

namespace tutti::simulation {
namespace {

std::string name_by_place(std::size_t i) {
  constexpr std::array kNames = {"alpha", "bravo", "charlie", "delta", "echo", "foxtrot", "golf", "hotel"};
  return i < kNames.size() ? kNames[i] : "robot" + std::to_string(i);
}

std::optional<std::size_t> given_start(const SimulatedRobotConfig& robot) {
  if (!robot.start_junction) return std::nullopt;
  return static_cast<std::size_t>(*robot.start_junction);
}

Status check_robots(const SimulationConfig& config, const CorridorWorld& network) {
  if (config.robots.empty()) return fail(ErrorCode::configuration, "simulation.robots is empty, expected a robot");
  std::set<std::string> names;
  for (std::size_t i = 0; i < config.robots.size(); ++i) {
    const std::string& name = config.robots[i].name;
    if (!names.insert(name).second)
      return fail(ErrorCode::configuration, "simulation.robots.{}: name '{}' is taken", i, name);
    if (auto ok = check_walk(network, config.robots[i].walk, given_start(config.robots[i])); !ok)
      return in_context("robot " + name, ok.error());
  }
  return {};
}

Recording simulate_robot(const SimulatedRobotConfig& config, const CorridorWorld& network,
                         std::optional<std::size_t> junction, Timestamp start, const Rng& rng) {
  Recording recording;
  recording.reference = simulate_walk(network, config.walk, start, junction, rng.fork("walk"));
  OdometrySimulation simulated =
      simulate_odometry(recording.reference, surroundings_along(network, recording.reference), config.odometry.config(),
                        rng.fork("odometry"));
  recording.odometry = std::move(simulated.odometry);
  recording.increment_covariance = std::move(simulated.increment_covariance);
  recording.drift_origins = std::move(simulated.drift_origins);
  return recording;
}

}  // namespace

TriangleMesh world_mesh(const SimulationConfig& config, std::uint64_t seed) {
  const Rng rng(seed);
  return world_surface(make_world(config.world, rng.fork("world")), config.surface, rng.fork("surface"));
}

std::vector<SimulatedRobotConfig> single_robots(const std::vector<SimulatedRobotConfig>& robots) {
  std::vector<SimulatedRobotConfig> out;
  for (const SimulatedRobotConfig& robot : robots)
    for (int k = 1; k <= robot.copies; ++k) {
      out.push_back(robot);
      out.back().copies = 1;
      if (robot.copies > 1 && !robot.name.empty()) out.back().name += std::to_string(k);
      if (robot.name.empty()) out.back().name = name_by_place(out.size() - 1);
    }
  return out;
}

Result<SimulatedWorld> simulate_recordings(const SimulationConfig& fleet, Timestamp start, std::uint64_t seed) {
  SimulationConfig config = fleet;
  config.robots = single_robots(fleet.robots);
  const Rng rng(seed);
  SimulatedWorld world{.network = make_world(config.world, rng.fork("world")), .recordings = {}, .surface = {}};
  if (auto ok = check_world(world.network, config.world); !ok) return tl::unexpected(ok.error());
  if (auto ok = check_robots(config, world.network); !ok) return tl::unexpected(ok.error());
  std::shared_ptr<const Bvh> walls;
  if (config.sensors == "lidar") {
    if (auto ok = check_surface(world.network, config.surface); !ok) return tl::unexpected(ok.error());
    world.surface = std::make_shared<const TriangleMesh>(world_mesh(config, seed));
    walls = std::make_shared<const Bvh>(*world.surface);
  }
  const std::vector<std::size_t> starts = spread_starts(world.network, config.robots.size(), rng.fork("starts"));
  for (std::size_t i = 0; i < config.robots.size(); ++i) {
    const SimulatedRobotConfig& robot = config.robots[i];
    std::optional<std::size_t> junction;
    if (robot.walk.route.empty()) junction = given_start(robot).value_or(starts[i]);
    Recording recording = simulate_robot(robot, world.network, junction, start + robot.start_s, rng.fork(i));
    recording.robot = RobotId{static_cast<std::uint32_t>(i)};
    recording.name = config.robots[i].name;
    if (walls)
      recording.scans = std::make_shared<SimulatedLidar>(walls, recording.reference, config.lidar.config(),
                                                         rng.fork(i).fork("lidar"));
    world.recordings.push_back(std::move(recording));
  }
  return world;
}

}  // namespace tutti::simulation
