// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <vector>

#include "tutti/localise/localiser.hpp"
#include "tutti/simulation/recordings.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"

namespace tutti::localise::test {

/// A piece of tunnel in which two robots made a map with perfect odometry, and a third drives with its own.
struct World {
  std::vector<Recording> robots;
  std::shared_ptr<const KnownMap> map;
};

inline const verifiers::VerifierConfig kVerifier;

inline std::shared_ptr<const server::ClosureVerifier> verifier() { return verifiers::make_verifier(kVerifier); }

/// Feeds a robot's odometry and scans, from one sample to another, to what takes inputs.
template <class Taker>
void feed(const Recording& robot, const Trajectory& odometry, std::size_t from, std::size_t to, Taker& taker,
          const std::function<void()>& after = {}) {
  for (std::size_t k = from; k < std::min(to, odometry.size()); ++k) {
    Matrix6d step = Matrix6d::Identity() * 1e-6;
    ASSERT_TRUE(taker.add(OdometrySample{odometry[k].stamp, odometry[k].pose, step}).has_value());
    if (taker.wants_scan(odometry[k].stamp))
      if (const auto scan = robot.scans->scan(k); scan && *scan) (void)taker.add(**scan);
    if (after) after();
  }
}

inline std::shared_ptr<KnownMap> map_of(const std::vector<Recording>& robots) {
  auto map = std::make_shared<KnownMap>();
  auto payloads = std::make_shared<server::MemoryPayloadStore>();
  for (const Recording& robot : robots) {
    robot::SubmapConfig config;
    config.fit.scans = "off";
    config.has_scans = true;
    robot::SubmapBuilder builder(ChainId(robot.robot), config);
    feed(robot, robot.reference, 0, robot.reference.size(), builder);
    builder.finish();
    while (const auto submap = builder.take_submap()) {
      KnownMap::Entry entry{.submap = std::make_shared<const Submap>(without_payloads(*submap)),
                            .T_world_submap = submap->keyframes.front().T_odom_body,
                            .place = verifier()->place_of(*submap),
                            .size = payload_size(*submap)};
      entry.middle = submap->keyframes[submap->keyframes.size() / 2].T_odom_body.translation;
      EXPECT_TRUE(payloads->put(*submap).has_value());
      map->submaps.emplace(submap->id, std::move(entry));
    }
  }
  map->payloads = std::move(payloads);
  map->id = "test";
  return map;
}

inline World make_world(std::uint64_t seed) {
  simulation::SimulationConfig config;
  config.sensors = "lidar";
  config.lidar.rays_share = 0.5;
  config.world.network.rows = 2;
  config.world.network.columns = 2;
  config.world.network.block_m = 22.0;
  config.world.featureless_share = 0.0;
  config.robots.resize(3);
  for (auto& robot : config.robots) {
    robot.walk.duration_s = 110.0;
    robot.walk.rate_hz = 5.0;
    robot.walk.pauses_per_min = 0.0;
    robot.odometry.yaw_bias_deg_per_m = 0.1;
  }
  auto world = simulation::simulate_recordings(config, Timestamp{0}, seed);
  EXPECT_TRUE(world.has_value()) << world.error().message;
  World out{.robots = std::move(world->recordings), .map = {}};
  out.map = map_of({out.robots[0], out.robots[1]});
  return out;
}

}  // namespace tutti::localise::test
