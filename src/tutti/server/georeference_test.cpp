// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/georeference.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "support/sanitized.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/server/graph_monitor.hpp"
#include "tutti/server/map_components.hpp"
#include "tutti/server/refuted_closures.hpp"
#include "tutti/simulation/receiver.hpp"

namespace tutti::server {
namespace georeference_test {

using simulation::ReceiverConfig;

struct Robot {
  std::uint32_t id = 0;
  double side_m = 120.0;           ///< The square's that it goes round once, at 1 m/s.
  Eigen::Vector3d start{0, 0, 0};  ///< In the truth.
  double drift_deg_per_m = 0.0;    ///< In yaw.
  double sigma_deg = 0.5;          ///< A step's turn, as stated.
  double slip_deg = 0.0;           ///< At half of the trajectory, and stated nowhere.
  double tilt_deg = 0.0;           ///< Its odometry frame's.
  ReceiverConfig receiver{.sigma_m = 0.5, .sigma_up_m = 1.0};
};

constexpr int kPerSubmap = 10;

/// Round a square, 4 sides; then a step towards its middle for every second beyond.
Trajectory truth_of(const Robot& robot, int seconds) {
  Trajectory out;
  Pose3 at{Eigen::Quaterniond::Identity(), robot.start};
  for (int k = 0; k <= seconds; ++k) {
    out.push_back({Timestamp{0} + static_cast<double>(k), at});
    const bool turns = k > 0 && k % static_cast<int>(std::max(1.0, robot.side_m)) == 0;
    const double yaw = turns ? std::numbers::pi / 2 : 0.0;
    at = at * Pose3{Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())),
                    {std::min(1.0, robot.side_m), 0, 0}};
  }
  return out;
}

struct World {
  SubmapSet submaps;
  std::map<ChainId, Trajectory> truth;

  void add(const Robot& robot, std::uint64_t seed = 1, int seconds = 480) {
    const Trajectory trajectory = truth_of(robot, seconds);
    Rng rng = Rng(seed).fork(robot.id);
    Trajectory odometry{
        {trajectory[0].stamp,
         {Eigen::Quaterniond(Eigen::AngleAxisd(robot.tilt_deg * std::numbers::pi / 180.0, Eigen::Vector3d::UnitX())),
          {3, 2, 1}}}};
    Matrix6d covariance = Matrix6d::Identity();
    covariance.topLeftCorner<3, 3>() *= 0.01 * 0.01;
    covariance.bottomRightCorner<3, 3>() *= std::pow(robot.sigma_deg * std::numbers::pi / 180.0, 2);
    for (std::size_t k = 1; k < trajectory.size(); ++k) {
      Vector6d error = Vector6d::Zero();
      for (int axis = 0; axis < 3; ++axis) error(axis) = rng.normal(0.01);
      error(5) =
          (rng.normal(robot.sigma_deg) + robot.drift_deg_per_m + (k == trajectory.size() / 2 ? robot.slip_deg : 0.0)) *
          std::numbers::pi / 180.0;
      odometry.push_back(
          {trajectory[k].stamp,
           retract(odometry.back().pose * trajectory[k - 1].pose.inverse() * trajectory[k].pose, error)});
    }
    const auto fixes = simulation::simulate_fixes(trajectory, robot.receiver, {}, rng.fork("receiver"));
    const ChainId chain{RobotId{robot.id}};
    truth[chain] = trajectory;
    for (std::size_t first = 0; first + 1 < trajectory.size(); first += kPerSubmap) {
      const std::size_t last = std::min(first + kPerSubmap, trajectory.size() - 1);
      Submap submap{.id = {chain, static_cast<std::uint32_t>(first / kPerSubmap)}};
      for (std::size_t k = first; k <= last; ++k) {
        submap.keyframes.push_back({static_cast<std::uint32_t>(k), odometry[k].stamp, odometry[k].pose, true});
        if (k > first) submap.odometry.push_back({odometry[k - 1].pose.inverse() * odometry[k].pose, covariance});
      }
      for (const PositionFix& fix : fixes)
        if (fix.stamp >= odometry[first].stamp && fix.stamp < odometry[last].stamp) {
          const auto k = static_cast<std::uint32_t>(std::lround(fix.stamp - trajectory[0].stamp));
          submap.fixes.push_back({k, fix.p_body_antenna, fix.antenna, fix.covariance});
        }
      submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
    }
  }

  [[nodiscard]] MapEstimate map(const GeoreferenceConfig& config = {}) const {
    return georeferenced(estimate_map(submaps, {}, {}), submaps, config, {});
  }
  /// Compares the positions of all nodes of a component, after one rigid alignment.
  [[nodiscard]] double rmse(const MapEstimate& map, std::optional<RobotId> robot = {}) const {
    std::vector<Eigen::Vector3d> expected, estimate;
    for (const MapNode& node : map.nodes) {
      if (robot && node.id.chain.robot != *robot) continue;
      expected.push_back(truth.at(node.id.chain)[node.id.index].pose.translation);
      estimate.push_back(node.T_world_body.translation);
    }
    const Pose3 T = align_points(expected, estimate);
    double sum = 0.0;
    for (std::size_t i = 0; i < expected.size(); ++i) sum += (expected[i] - T * estimate[i]).squaredNorm();
    return std::sqrt(sum / static_cast<double>(expected.size()));
  }
};

std::size_t count(const MapEstimate& map, FixObjection objection) {
  return static_cast<std::size_t>(std::ranges::count(map.fixes.judged, objection, &JudgedFixes::objection));
}

/// Where the map puts a node on the earth, against where the simulation has it.
double off_on_earth(const World& world, const MapEstimate& map, const MapNode& node) {
  const simulation::PlaceConfig place;
  const Georeference& geo = *map.fixes.georeference;
  const Eigen::Vector3d found = enu_in_ecef(geo.origin) * (geo.T_enu_world * node.T_world_body.translation);
  const Eigen::AngleAxisd yaw(place.yaw_deg * std::numbers::pi / 180.0, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d truth = enu_in_ecef({place.latitude_deg, place.longitude_deg, place.height_m}) *
                                (yaw * world.truth.at(node.id.chain)[node.id.index].pose.translation);
  return (found - truth).norm();
}

TEST(Georeference, WithoutFixesTheMapIsAsItWas) {
  World world;
  Robot robot;
  robot.receiver.rate_hz = 1e-3;
  robot.receiver.outage_s = {0, 1e9};
  world.add(robot);
  const MapEstimate before = estimate_map(world.submaps, {}, {}), after = world.map();
  EXPECT_FALSE(after.fixes.georeference);
  EXPECT_TRUE(after.fixes.judged.empty() && after.fixes.edges.empty());
  for (std::size_t i = 0; i < before.nodes.size(); ++i)
    EXPECT_TRUE(before.nodes[i].T_world_body == after.nodes[i].T_world_body);
}

TEST(Georeference, LaysAMapOnTheEarthWithoutBendingIt) {
  World world;
  world.add({});
  const MapEstimate before = estimate_map(world.submaps, {}, {}), map = world.map({.mode = "only"});
  ASSERT_TRUE(map.fixes.georeference);
  for (std::size_t i = 0; i < map.nodes.size(); ++i)
    EXPECT_TRUE(before.nodes[i].T_world_body == map.nodes[i].T_world_body);
  for (const MapNode& node : map.nodes) ASSERT_LT(off_on_earth(world, map, node), 5.0 * world.rmse(map));
}

TEST(Georeference, FactorsTakeDriftAway) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    World world;
    world.add({}, seed);
    const double without = world.rmse(estimate_map(world.submaps, {}, {}));
    const MapEstimate map = world.map();
    ASSERT_TRUE(map.fixes.georeference);
    EXPECT_GT(without, 1.0);
    EXPECT_LT(world.rmse(map), 0.6);
    EXPECT_EQ(count(map, FixObjection::none), map.fixes.judged.size());
    for (const MapNode& node : map.nodes) ASSERT_LT(off_on_earth(world, map, node), 2.0);
  }
}

TEST(Georeference, WrongFixesHarmNothing) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U})
    for (const double lasts_s : {0.0, 20.0}) {
      World world;
      Robot robot;
      robot.receiver.wrong_share = 0.2;
      robot.receiver.wrong_lasts_s = lasts_s;
      world.add(robot, seed);
      const double without = world.rmse(estimate_map(world.submaps, {}, {}));
      EXPECT_LT(world.rmse(world.map()), std::min(0.8, without)) << seed << " " << lasts_s;
    }
}

/// Everybody's place is found, though nobody met anybody.
TEST(Georeference, JoinsRobotsThatNeverMeet) {
  for (const char* mode : {"only", "factors"}) {
    World world;
    world.add({.id = 0});
    world.add({.id = 1, .start = {400, 250, 5}});
    const MapEstimate apart = estimate_map(world.submaps, {}, {}), map = world.map({.mode = mode});
    EXPECT_EQ(apart.components, 2U);
    EXPECT_EQ(map.components, 1U);
    EXPECT_EQ(choose_components(map).of_chain.size(), 2U);
    EXPECT_LT(world.rmse(map), std::string(mode) == "only" ? 8.0 : 0.6) << mode;
    const ProxyGraph graph = monitor_graph(map, 1, {});
    EXPECT_EQ(graph.components.size(), 2U);
    EXPECT_EQ(graph.components[0].component, graph.components[1].component);
    for (const ProxyNode& node : graph.nodes) EXPECT_TRUE(node.covariance.allFinite());
  }
}

TEST(Georeference, WhatHasNotMovedIsNotJoinedAndSaysSo) {
  World world;
  world.add({.id = 0});
  world.add({.id = 1, .side_m = 0.01, .start = {400, 250, 5}});
  const MapEstimate map = world.map();
  EXPECT_EQ(map.components, 2U);
  ASSERT_EQ(map.fixes.unaligned.size(), 1U);
  EXPECT_EQ(map.fixes.unaligned[0].chain, ChainId{RobotId{1}});
  EXPECT_NE(map.fixes.unaligned[0].why.find("heading"), std::string::npos) << map.fixes.unaligned[0].why;
  EXPECT_EQ(count(map, FixObjection::unaligned), 48U);
}

TEST(Georeference, SwappedCoordinatesAreNotBelieved) {
  World world;
  Robot robot;
  robot.receiver.swapped = true;
  world.add(robot);
  const MapEstimate map = world.map();
  EXPECT_FALSE(map.fixes.georeference);
  ASSERT_EQ(map.fixes.unaligned.size(), 1U);
  EXPECT_NE(map.fixes.unaligned[0].why.find("swapped"), std::string::npos) << map.fixes.unaligned[0].why;
}

TEST(Georeference, AReceiverThatStatesTooLittleIsHeardAsFarAsItDeserves) {
  World world;
  Robot robot;
  robot.receiver.sigma_m = 2.0;
  robot.receiver.sigma_up_m = 4.0;
  robot.receiver.stated_factor = 0.05;  // 10 cm
  world.add(robot);
  const double without = world.rmse(estimate_map(world.submaps, {}, {}));
  const MapEstimate map = world.map();
  EXPECT_LT(world.rmse(map), 0.6 * without);
  EXPECT_EQ(map.fixes.understated.size(), 1U);
}

TEST(Georeference, ALeverArmCountsWithTheHeading) {
  World world;
  Robot robot;
  robot.receiver.sigma_m = 0.05;
  robot.receiver.sigma_up_m = 0.05;
  robot.receiver.antenna_m = {5.0, 2.0, 1.0};
  world.add(robot);
  EXPECT_LT(world.rmse(world.map()), 0.1);
}

/// The frame of an odometry may be tilted as it likes where fixes measure how.
TEST(Georeference, ATiltedFrameIsLaidFlat) {
  World world;
  Robot robot{.tilt_deg = 70.0};
  robot.receiver.sigma_m = robot.receiver.sigma_up_m = 0.1;
  world.add(robot);
  const MapEstimate map = world.map();
  ASSERT_TRUE(map.fixes.georeference);
  EXPECT_FALSE(map.fixes.georeference->is_levelled);
  for (const MapNode& node : map.nodes) ASSERT_LT(off_on_earth(world, map, node), 1.0);
}

/// A turn that odometry does not know of: whichever half of the fixes is believed, nothing is worse than without.
TEST(Georeference, ASlipOfTheOdometryIsNotMadeWorse) {
  for (const std::uint64_t seed : {1U, 2U, 3U})
    for (const double slip_deg : {5.0, 20.0, 60.0}) {
      World world;
      world.add({.sigma_deg = 0.1, .slip_deg = slip_deg}, seed);
      const double without = world.rmse(estimate_map(world.submaps, {}, {}));
      const double rounding = kSanitized ? 1.002 : 1.0;  // by Clang, which compiles for sanitizers: 1.0011 at most
      EXPECT_LT(world.rmse(world.map()), rounding * without) << seed << " " << slip_deg;
    }
}

/// A null island's worth of nonsense, the first of all: no origin, and no harm.
TEST(Georeference, TheOriginIsNotWhereOneFixIsWrong) {
  World world;
  world.add({});
  auto first = std::make_shared<Submap>(*world.submaps.begin()->second);
  for (SubmapFix& fix : first->fixes) fix.antenna = {0, 0, 0};
  world.submaps.begin()->second = first;
  const MapEstimate map = world.map();
  ASSERT_TRUE(map.fixes.georeference);
  EXPECT_NEAR(map.fixes.georeference->origin.latitude_deg, 46.5, 0.01);
  EXPECT_NE(map.fixes.judged.front().objection, FixObjection::none);
  EXPECT_LT(world.rmse(map), 0.6);
}

/// Closures that agree with each other, all wrong: without fixes they join the two where they never were. Right ones
/// stay.
TEST(Georeference, FixesRefuteClosuresThatJoinRobotsWrongly) {
  World world;
  world.add({.id = 0});
  world.add({.id = 1, .start = {100, 30, 0}});
  const auto verdicts_of = [&](const Eigen::Vector3d& wrong_m) {
    VerdictSet verdicts;
    for (std::uint32_t k = 3; k < 9; ++k) {
      const SubmapPair pair{{ChainId{RobotId{0}}, k}, {ChainId{RobotId{1}}, k}};
      const std::uint32_t at = k * kPerSubmap;
      const Pose3 from = world.truth.at(pair.first.chain)[at].pose, to = world.truth.at(pair.second.chain)[at].pose;
      const Pose3 T_world_wrong{Eigen::Quaterniond::Identity(), wrong_m};
      const RelativePose measured{from.inverse() * T_world_wrong * to, Matrix6d::Identity() * 1e-4};
      verdicts[pair] = {.pair = pair, .closures = {{{pair.first.chain, at}, {pair.second.chain, at}, measured}}};
    }
    return verdicts;
  };
  for (const bool are_wrong : {true, false}) {
    const VerdictSet verdicts = verdicts_of(are_wrong ? Eigen::Vector3d(90, -60, 0) : Eigen::Vector3d(0, 0, 0));
    EXPECT_EQ(estimate_map(world.submaps, verdicts, {}).components, 1U);
    const MapEstimate judged = estimate_map_with_fixes(world.submaps, verdicts, {});
    EXPECT_EQ(judged.components, are_wrong ? 2U : 1U);
    for (const JudgedClosure& closure : judged.closures)
      EXPECT_EQ(closure.objection, are_wrong ? judge::Objection::fixes : judge::Objection::none);
    const MapEstimate map = georeferenced(judged, world.submaps, {}, {});
    EXPECT_EQ(map.components, 1U);
    EXPECT_LT(world.rmse(map), 0.6);
  }
}

/// Drivers state correlations of 1, which rounding makes a little more, and errors along one line only.
TEST(Georeference, FixesOfSingularCovariancesCountAsFarAsTheyCan) {
  Eigen::Matrix3d correlated = Eigen::Vector3d(0.25, 0.25, 1.0).asDiagonal();
  correlated(0, 1) = correlated(1, 0) = 0.25;
  Eigen::Matrix3d rounded = correlated;
  rounded(0, 1) = rounded(1, 0) = 0.25 * (1.0 + 1e-6);
  const Eigen::Matrix3d line = Eigen::Vector3d(0.3, 0.4, 0.5) * Eigen::RowVector3d(0.3, 0.4, 0.5);
  for (const Eigen::Matrix3d& covariance : {correlated, rounded, line}) {
    ASSERT_TRUE(check_fix({}, covariance, Eigen::Vector3d::Zero())) << covariance;
    World world;
    world.add({});
    for (auto& [id, submap] : world.submaps) {
      auto stated = std::make_shared<Submap>(*submap);
      for (SubmapFix& fix : stated->fixes) fix.covariance = covariance;
      submap = stated;
    }
    const double without = world.rmse(estimate_map(world.submaps, {}, {}));
    const MapEstimate map = world.map();
    ASSERT_TRUE(map.fixes.georeference) << covariance;
    EXPECT_GT(map.fixes.edges.size(), 0U) << covariance;
    for (const PoseGraphEdge& edge : map.fixes.edges) ASSERT_TRUE(edge.information.allFinite()) << covariance;
    for (const MapNode& node : map.nodes) ASSERT_TRUE(node.T_world_body.translation.allFinite()) << covariance;
    EXPECT_LT(world.rmse(map), without) << covariance;
  }
}

TEST(Georeference, IsAFunctionOfTheSet) {
  World world;
  world.add({.id = 0});
  world.add({.id = 1, .start = {400, 250, 5}});
  const MapEstimate a = world.map(), b = world.map();
  for (std::size_t i = 0; i < a.nodes.size(); ++i) EXPECT_TRUE(a.nodes[i].T_world_body == b.nodes[i].T_world_body);
}

TEST(Georeference, OffIsOff) {
  World world;
  world.add({});
  const MapEstimate map = world.map({.mode = "off"});
  EXPECT_TRUE(map.fixes.judged.empty());
  EXPECT_FALSE(map.fixes.georeference);
}

}  // namespace georeference_test
}  // namespace tutti::server
