// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/simulation/corridor_world.hpp"
#include "tutti/simulation/odometry.hpp"
#include "tutti/simulation/trajectory.hpp"

namespace tutti::simulation {

struct SimulationConfig {
  int robots = 2;
  CorridorWorldConfig world;
  WalkConfig walk;
  OdometryNoiseConfig odometry;
  template <class V>
  void describe(V& v) {
    v.field("robots", robots, between(1, 100), "Robots in the network, each with its own start and odom frame.");
    v.field("world", world, any(), "The corridor network.");
    v.field("walk", walk, any(), "How the robots walk.");
    v.field("odometry", odometry, any(), "Errors of their odometry.");
  }
};

/// Robots 0, 1, ... named "alpha", "bravo", ..., walking at the same time through one corridor network.
std::vector<Recording> simulate_recordings(const SimulationConfig& config, Timestamp start, std::uint64_t seed);

}  // namespace tutti::simulation
