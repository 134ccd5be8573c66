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
namespace trajectory_test {

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

double ground_length(const Trajectory& truth) {
  double length = 0.0;
  for (std::size_t k = 1; k < truth.size(); ++k)
    length += (truth[k].pose.translation - truth[k - 1].pose.translation).norm();
  return length;
}

RC_GTEST_PROP(SimulateWalk, TravelsTheLengthAskedFor, ()) {
  CorridorWorldConfig world_config;
  const CorridorWorld world = any_world(world_config);
  WalkConfig config;
  config.duration_s = *rc::gen::element(300.0, 900.0);
  config.length_m = *rc::gen::element(0.3, 0.6) * config.duration_s;
  config.pauses_per_min = *rc::gen::element(0.0, 2.0);
  config.gait = "rolling";  // a gait's ups and downs are no distance travelled
  const Trajectory truth = simulate_walk(world, config, {}, std::nullopt, Rng(*rc::gen::arbitrary<std::uint32_t>()));
  RC_ASSERT(truth.size() == static_cast<std::size_t>(config.duration_s * config.rate_hz) + 1);
  RC_ASSERT(std::abs(ground_length(truth) - config.length_m) < 0.005 * config.length_m);
}

TEST(SimulateWalk, StandsStillAsOftenAndAsLongAsAskedGaitAndAll) {
  const CorridorWorld world = make_corridor_world({}, Rng(1));
  WalkConfig config;
  config.duration_s = 3600.0;
  config.pauses_per_min = 1.0;
  config.pause_s = 10.0;
  const Trajectory truth = simulate_walk(world, config, {}, 0, Rng(3));
  int stops = 0;
  int still = 0;
  bool moved = true;
  for (std::size_t k = 1; k < truth.size(); ++k) {
    const bool stands = truth[k].pose == truth[k - 1].pose;
    if (stands) ++still;
    if (stands && moved) ++stops;
    moved = !stands;
  }
  EXPECT_NEAR(stops, 51, 20);  // a minute of walking between two stops of 10 s
  EXPECT_NEAR(still / config.rate_hz / stops, 10.0, 2.5);
}

/// Whether the walk passes the junctions in this order, coming within `near_m` of each before the next.
bool passes_in_order(const CorridorWorld& world, const Trajectory& truth, const std::vector<int>& order,
                     double near_m) {
  std::size_t next = 0;
  for (const StampedPose& sample : truth) {
    const Eigen::Vector3d& junction = world.junctions[static_cast<std::size_t>(order[next])];
    if ((sample.pose.translation - junction).norm() < near_m && ++next == order.size()) return true;
  }
  return false;
}

TEST(SimulateWalk, FollowsItsRouteRoundAndRound) {
  const CorridorWorld world = make_corridor_world({.missing_share = 0.0}, Rng(1));  // 4 rows of 5
  WalkConfig config;
  config.route = {6, 7, 12, 11};
  const Trajectory truth = simulate_walk(world, config, {}, std::nullopt, Rng(3));
  EXPECT_TRUE(passes_in_order(world, truth, {6, 7, 12, 11, 6, 7, 12, 11, 6}, 1.5));
  EXPECT_FALSE(passes_in_order(world, truth, {11, 12, 7}, 1.5) && passes_in_order(world, truth, {8}, 1.5));
  for (const StampedPose& sample : truth)  // nowhere else
    for (const std::size_t other : {0U, 5U, 8U, 13U, 17U})
      EXPECT_GT((sample.pose.translation - world.junctions[other]).norm(), 5.0);
}

TEST(CheckWalk, SaysWhatIsWrong) {
  const CorridorWorld world = make_corridor_world({.missing_share = 0.0}, Rng(1));
  const auto problem = [&](std::vector<int> route, std::optional<std::size_t> start = {}) {
    WalkConfig config;
    config.route = std::move(route);
    const Status ok = check_walk(world, config, start);
    return ok ? std::string() : ok.error().message;
  };
  EXPECT_EQ(problem({}), "");
  EXPECT_EQ(problem({}, 19), "");
  EXPECT_EQ(problem({0, 1, 6, 5}), "");
  EXPECT_NE(problem({}, 20).find("0 .. 19"), std::string::npos);
  EXPECT_NE(problem({0, 1, 6}).find("6 and 0"), std::string::npos);  // not closed
  EXPECT_NE(problem({0, 1}).find("turns back at junction 1"), std::string::npos);
  EXPECT_NE(problem({0, 99}).find("99"), std::string::npos);
  EXPECT_NE(problem({0, 1}, 0).find("expected one"), std::string::npos);
}

TEST(CheckWalk, RefusesWhatHasNoRoomOrNoEnd) {
  const CorridorWorld world =
      make_corridor_world({.rows = 3, .columns = 3, .jitter_m = 0.0, .missing_share = 0.0}, Rng(1));
  const auto problem = [&](const WalkConfig& config) {
    const Status ok = check_walk(world, config, {});
    return ok ? std::string() : ok.error().message;
  };
  EXPECT_EQ(problem({.lookahead_m = 24.9}), "");  // the network is 50 m wide
  EXPECT_NE(problem({.lookahead_m = 25.0}).find("walk.lookahead_m is 25, expected less than 25"), std::string::npos);
  EXPECT_EQ(problem({.route = {0, 1, 4, 3}, .lookahead_m = 12.0}), "");
  EXPECT_NE(problem({.route = {0, 1, 4, 3}, .lookahead_m = 13.0}).find("less than 12.5"), std::string::npos);
  EXPECT_NE(problem({.duration_s = 604800.0, .rate_hz = 1000.0}).find("6.05e+08 poses"), std::string::npos);
  EXPECT_NE(problem({.duration_s = 604800.0, .rate_hz = 1.0, .max_speed_mps = 100.0}).find("6.05e+07 m"),
            std::string::npos);
}

TEST(CheckWalk, AWalkWithTheLeastRoomEnds) {
  const CorridorWorld world =
      make_corridor_world({.rows = 2, .columns = 2, .jitter_m = 0.0, .missing_share = 0.0}, Rng(1));
  const Trajectory truth = simulate_walk(world, {.duration_s = 200.0, .lookahead_m = 12.4}, {}, 0, Rng(1));
  for (const StampedPose& sample : truth) ASSERT_LT(sample.pose.translation.norm(), 50.0);
}

TEST(SimulateWalk, SameSeedSameBits) {
  const CorridorWorld world = make_corridor_world({}, Rng(1));
  WalkConfig config;
  config.duration_s = 60.0;
  EXPECT_EQ(simulate_walk(world, config, {}, 3, Rng(5)), simulate_walk(world, config, {}, 3, Rng(5)));
  EXPECT_NE(simulate_walk(world, config, {}, 3, Rng(5)), simulate_walk(world, config, {}, 3, Rng(6)));
}

}  // namespace trajectory_test
}  // namespace tutti::simulation
