// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/recordings.hpp"

#include <array>
#include <string>
#include <utility>

namespace tutti::simulation {
namespace {

std::string robot_name(std::size_t i) {
  constexpr std::array kNames = {"alpha", "bravo", "charlie", "delta", "echo", "foxtrot", "golf", "hotel"};
  return i < kNames.size() ? kNames[i] : "robot" + std::to_string(i);
}

}  // namespace

std::vector<Recording> simulate_recordings(const SimulationConfig& config, Timestamp start, std::uint64_t seed) {
  const Rng rng(seed);
  const CorridorWorld world = make_corridor_world(config.world, rng.fork("world"));
  const auto robots = static_cast<std::size_t>(config.robots);
  const std::vector<std::size_t> starts = spread_starts(world, robots, rng.fork("starts"));
  std::vector<Recording> recordings;
  for (std::size_t i = 0; i < robots; ++i) {
    const Rng robot_rng = rng.fork(i);
    Recording recording;
    recording.robot = RobotId{static_cast<std::uint32_t>(i)};
    recording.name = robot_name(i);
    recording.reference = simulate_walk(world, config.walk, start, starts[i], robot_rng.fork("walk"));
    OdometrySimulation simulated = simulate_odometry(recording.reference, config.odometry, robot_rng.fork("odometry"));
    recording.odometry = std::move(simulated.odometry);
    recording.increment_covariance = std::move(simulated.increment_covariance);
    recordings.push_back(std::move(recording));
  }
  return recordings;
}

}  // namespace tutti::simulation
