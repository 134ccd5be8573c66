// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/trajectory.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "tutti/simulation/corridor_world.hpp"

namespace tutti::simulation {
namespace {

CorridorWorld any_world(CorridorWorldConfig& config) {
  config.rows = *rc::gen::inRange(2, 6);
  config.columns = *rc::gen::inRange(2, 6);
  config.missing_share = *rc::gen::element(0.0, 0.2, 0.5, 1.0);
  return make_corridor_world(config, Rng(*rc::gen::arbitrary<std::uint32_t>()));
}

double distance_to_corridor(const CorridorWorld& world, const Corridor& corridor, const Eigen::Vector3d& p) {
  const Eigen::Vector3d a = world.junctions[corridor.a];
  const Eigen::Vector3d d = world.junctions[corridor.b] - a;
  return (p - a - std::clamp((p - a).dot(d) / d.squaredNorm(), 0.0, 1.0) * d).norm();
}

RC_GTEST_PROP(CorridorWorld, IsConnectedWithoutDeadEndsOrSteepParts, ()) {
  CorridorWorldConfig config;
  const CorridorWorld world = any_world(config);
  RC_ASSERT(world.junctions.size() == static_cast<std::size_t>(config.rows * config.columns));
  std::set<std::size_t> reached{0};
  std::vector<std::size_t> stack{0};
  while (!stack.empty()) {
    const std::size_t at = stack.back();
    stack.pop_back();
    RC_ASSERT(world.corridors_at[at].size() >= 2U);
    for (const std::size_t corridor : world.corridors_at[at]) {
      const std::size_t next = world.other_end(corridor, at);
      if (reached.insert(next).second) stack.push_back(next);
    }
  }
  RC_ASSERT(reached.size() == world.junctions.size());
  for (const Corridor& corridor : world.corridors) {
    const Eigen::Vector3d d = world.junctions[corridor.b] - world.junctions[corridor.a];
    RC_ASSERT(std::abs(corridor.length_m - d.norm()) < 1e-12);
    RC_ASSERT(std::abs(d.z()) <= config.max_slope * d.head<2>().norm() * (1.0 + 1e-9));
  }
}

RC_GTEST_PROP(SimulateWalk, IsSmoothAndStaysInTheCorridors, ()) {
  CorridorWorldConfig world_config;
  const CorridorWorld world = any_world(world_config);
  WalkConfig config;
  config.duration_s = 120.0;
  config.rate_hz = *rc::gen::element(4.0, 8.0, 20.0);
  const Timestamp start{1'700'000'000'000'000'123};
  const Trajectory truth = simulate_walk(world, config, start, std::nullopt, Rng(*rc::gen::arbitrary<std::uint32_t>()));
  RC_ASSERT(truth.size() == static_cast<std::size_t>(config.duration_s * config.rate_hz) + 1);
  RC_ASSERT(truth.front().stamp == start);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const Pose3& pose = truth[k].pose;
    RC_ASSERT(is_valid(pose, 1e-9));
    RC_ASSERT((pose.rotation * Eigen::Vector3d::UnitZ()).z() > std::cos(10.0 * std::numbers::pi / 180.0));
    double nearest = std::numeric_limits<double>::infinity();
    for (const Corridor& corridor : world.corridors)
      nearest = std::min(nearest, distance_to_corridor(world, corridor, pose.translation));
    RC_ASSERT(nearest < 2.0);  // corners are cut, corridors not left
    if (k == 0) continue;
    const double dt = truth[k].stamp - truth[k - 1].stamp;
    RC_ASSERT(std::abs(dt - 1.0 / config.rate_hz) < 1e-8);
    const Pose3 increment = truth[k - 1].pose.inverse() * pose;
    // A chord is never longer than its arc; the gait adds a little.
    RC_ASSERT(increment.translation.norm() < 1.25 * config.max_speed_mps * dt);
    RC_ASSERT(increment.translation.x() > 0.0);
    RC_ASSERT(rotation_angle(increment) / dt < 1.5);
  }
}

TEST(SimulateWalk, KeepsItsSpeedRevisitsAndMeets) {
  const CorridorWorld world = make_corridor_world({}, Rng(1));
  const std::vector<std::size_t> starts = spread_starts(world, 2, Rng(2));
  EXPECT_GT((world.junctions[starts[0]] - world.junctions[starts[1]]).norm(), 50.0);
  const WalkConfig config;
  const Trajectory alpha = simulate_walk(world, config, {}, starts[0], Rng(3));
  const Trajectory bravo = simulate_walk(world, config, {}, starts[1], Rng(4));
  double distance = 0.0;
  for (std::size_t k = 1; k < alpha.size(); ++k)
    distance += (alpha[k].pose.translation - alpha[k - 1].pose.translation).norm();
  EXPECT_GT(distance, config.min_speed_mps * config.duration_s);
  EXPECT_LT(distance, 1.05 * config.max_speed_mps * config.duration_s);

  const auto seconds_near = [](const Trajectory& of, const Trajectory& other, double min_gap_s) {
    int count = 0;
    for (std::size_t i = 0; i < of.size(); i += 8)
      for (std::size_t j = 0; j < other.size(); j += 8)
        if (std::abs(of[i].stamp - other[j].stamp) >= min_gap_s &&
            (of[i].pose.translation - other[j].pose.translation).norm() < 2.0) {
          ++count;
          break;
        }
    return count;
  };
  EXPECT_GT(seconds_near(alpha, alpha, 60.0), 200);  // revisits, of 1200 s
  EXPECT_GT(seconds_near(alpha, bravo, 0.0), 400);   // places both have seen
}

TEST(SimulateWalk, SameSeedSameBits) {
  const CorridorWorld world = make_corridor_world({}, Rng(1));
  WalkConfig config;
  config.duration_s = 60.0;
  EXPECT_EQ(simulate_walk(world, config, {}, 3, Rng(5)), simulate_walk(world, config, {}, 3, Rng(5)));
  EXPECT_NE(simulate_walk(world, config, {}, 3, Rng(5)), simulate_walk(world, config, {}, 3, Rng(6)));
}

}  // namespace
}  // namespace tutti::simulation
