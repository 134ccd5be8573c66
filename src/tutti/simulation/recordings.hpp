// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/simulation/bounds.hpp"
#include "tutti/simulation/corridor_world.hpp"
#include "tutti/simulation/lidar.hpp"
#include "tutti/simulation/odometry.hpp"
#include "tutti/simulation/surface.hpp"
#include "tutti/simulation/trajectory.hpp"
#include "tutti/simulation/world.hpp"

namespace tutti::simulation {

/// One robot, or several alike, in a simulated mission; `describe` explains the fields.
struct SimulatedRobotConfig {
  std::string name;  ///< Empty: "alpha", "bravo", ... by position in the list.
  int copies = 1;
  double start_s = 0.0;
  std::optional<int> start_junction;  ///< Where it starts; none: far from the others. A route has one, too.
  WalkConfig walk;
  OdometryChoice odometry;
  template <class V>
  void describe(V& v) {
    v.field("name", name, any(), "Unique name; empty: alpha, bravo, ... by place in the list.");
    v.field("copies", copies, between(1, 100),
            "As many robots as this, alike but for what is drawn: start, walk, errors; of a name: it and a number.");
    v.field("start_s", start_s, between(0.0, kLongest_s), "Mission time at which it starts to walk.");
    v.field("walk", walk, any(), "How it walks.");
    v.field("odometry", odometry, any(), "Errors of its odometry.");
  }
};

/// A simulated mission in a network of corridors.
struct SimulationConfig {
  std::string sensors = "none";
  WorldConfig world;
  SurfaceConfig surface;
  LidarChoice lidar;
  std::vector<SimulatedRobotConfig> robots = std::vector<SimulatedRobotConfig>(2);
  template <class V>
  void describe(V& v) {
    v.field("sensors", sensors, one_of({"none", "lidar"}), "none: trajectories only, which is fast.");
    v.field("world", world, any(), "Where the robots walk.");
    v.field("surface", surface, any(), "lidar: what its walls look like.");
    v.field("lidar", lidar, any(), "lidar: the sensor of every robot.");
    v.field("robots", robots, any(), "The robots, each with its own start and odom frame.");
  }
};

/// One entry per robot: copies follow each other.
std::vector<SimulatedRobotConfig> single_robots(const std::vector<SimulatedRobotConfig>& robots);

/// The recordings of a simulated mission, and the world in which they were made.
struct SimulatedWorld {
  CorridorWorld network;
  std::vector<Recording> recordings;            ///< Robots 0, 1, ... in the order of single_robots().
  std::shared_ptr<const TriangleMesh> surface;  ///< As a survey would measure it; null without sensors.
};

/// The walls of the world that simulate_recordings() makes from the same configuration and seed; in the frame
/// `reference`.
TriangleMesh world_mesh(const SimulationConfig& config, std::uint64_t seed);

/// Simulates robots that walk through one world at the same time; the first sample of each is at `start` + start_s.
/// Fails when the configuration names a junction or corridor that the world does not have, or gives two robots one
/// name.
Result<SimulatedWorld> simulate_recordings(const SimulationConfig& config, Timestamp start, std::uint64_t seed);

}  // namespace tutti::simulation
