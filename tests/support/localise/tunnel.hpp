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

/// The walls, floor and ceiling of a lift, from its middle.
inline PointCloud lift() {
  constexpr float kHalf_m = 1.0F;
  PointCloud out;
  for (float a = -kHalf_m; a <= kHalf_m; a += 0.1F)
    for (float b = -kHalf_m; b <= kHalf_m; b += 0.1F)
      for (const float side : {-kHalf_m, kHalf_m})
        for (int axis = 0; axis < 3; ++axis) {
          Eigen::Vector3f& p = out.points.emplace_back();
          p[axis] = side;
          p[(axis + 1) % 3] = a;
          p[(axis + 2) % 3] = b;
        }
  return out;
}

/// The stages of a robot that drives on one floor, rides a lift for 20 s and drives on another.
enum class Ride { before, in_lift, after };
/// Feeds what the third robots of two worlds see on such a way to what takes inputs. `after_each` hears after each
/// sample where that was, and its number in the recording.
template <class Taker>
void ride(const World& from, const World& to, Taker& taker, const std::function<void(Ride, std::size_t)>& after_each) {
  constexpr std::size_t kIn = 200, kOut = 250, kEnd = 480;
  constexpr double kStep_s = 0.2;
  const Recording &first = from.robots[2], &second = to.robots[2];
  std::size_t k = 0;
  feed(first, first.odometry, 0, kIn, taker, [&] { after_each(Ride::before, k++); });
  const auto add = [&](Timestamp stamp, const Pose3& T_odom_body, std::optional<Scan> scan) {
    EXPECT_TRUE(taker.add(OdometrySample{stamp, T_odom_body, Matrix6d::Identity() * 1e-6}).has_value());
    if (!scan || !taker.wants_scan(stamp)) return;
    scan->stamp = stamp;
    (void)taker.add(*scan);
  };
  const StampedPose at = first.odometry[kIn - 1];
  const auto cabin = std::make_shared<const PointCloud>(lift());
  Timestamp stamp = at.stamp + kStep_s;
  for (; stamp - at.stamp < 20.0; stamp = stamp + kStep_s) {
    add(stamp, at.pose, Scan{.stamp = {}, .cloud = cabin, .age_s = nullptr});
    after_each(Ride::in_lift, 0);
  }
  const Pose3 T_shift = at.pose * second.odometry[kOut].pose.inverse();
  for (k = kOut; k < kEnd; ++k, stamp = stamp + kStep_s) {
    add(stamp, T_shift * second.odometry[k].pose, second.scans->scan(k).value());
    after_each(Ride::after, k);
  }
}

/// Two maps as the floors of one, each in its frame.
inline std::shared_ptr<KnownMap> as_floors(const KnownMap& first, const KnownMap& second) {
  auto out = std::make_shared<KnownMap>();
  auto payloads = std::make_shared<server::MemoryPayloadStore>();
  for (const std::uint32_t floor : {1U, 2U}) {
    const KnownMap& map = floor == 1 ? first : second;
    for (const auto& [id, entry] : map.submaps) {
      Submap submap = *entry.submap;
      submap.id.chain.robot.value += 100 * (floor - 1);
      submap.cloud = *map.payloads->cloud(id);
      EXPECT_TRUE(payloads->put(submap).has_value());
      KnownMap::Entry& there = out->submaps[submap.id] = entry;
      there.submap = std::make_shared<const Submap>(without_payloads(submap));
      there.floor = floor;
    }
  }
  out->floors = 2;
  out->payloads = std::move(payloads);
  out->id = "building";
  return out;
}

/// `featureless`: share of the tunnels that have nothing but walls.
inline World make_world(std::uint64_t seed, double featureless = 0.0) {
  simulation::SimulationConfig config;
  config.sensors = "lidar";
  config.lidar.rays_share = 0.5;
  config.world.network.rows = 2;
  config.world.network.columns = 2;
  config.world.network.block_m = 22.0;
  config.world.featureless_share = featureless;
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
