// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/graph_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/server/map_components.hpp"
#include "tutti/server/testing/world.hpp"

namespace tutti::server {
namespace {

/// Two robots with nodes 0..9 each, all representative, in one component.
MapEstimate two_chains() {
  MapEstimate map;
  for (std::uint32_t r = 0; r < 2; ++r)
    for (std::uint32_t k = 0; k < 10; ++k)
      map.nodes.push_back({.id = {RobotId{r}, k}, .stamp = {k}, .representative = true, .component = 0});
  return map;
}

JudgedClosure closure(std::uint32_t ra, std::uint32_t a, std::uint32_t rb, std::uint32_t b, bool accepted = true) {
  return {{{RobotId{ra}, a}, {RobotId{rb}, b}, {}}, accepted};
}

const std::vector<std::size_t> kFirstRobot{0, 1, 2, 3, 4, 5, 6, 7, 8, 9};

TEST(ClosureSupport, CountsTheClosuresThatSpanAStretch) {
  MapEstimate map = two_chains();
  map.closures = {closure(0, 2, 0, 6), closure(0, 4, 0, 8), closure(0, 1, 0, 9, false)};
  EXPECT_EQ(closure_support(map, kFirstRobot), (std::vector<std::uint32_t>{0, 0, 0, 1, 1, 2, 2, 1, 1, 0}));
}

TEST(ClosureSupport, ClosuresWithAnotherRobotSupportWhatLiesBetweenThem) {
  MapEstimate map = two_chains();
  map.closures = {closure(0, 2, 1, 3)};
  EXPECT_EQ(closure_support(map, kFirstRobot), (std::vector<std::uint32_t>(10, 0)));  // one alone makes no cycle
  map.closures.push_back(closure(0, 7, 1, 8));
  EXPECT_EQ(closure_support(map, kFirstRobot), (std::vector<std::uint32_t>{0, 0, 0, 1, 1, 1, 1, 1, 0, 0}));
}

TEST(ClosureSupport, FollowsTheChosenNodesOnly) {
  MapEstimate map = two_chains();
  map.closures = {closure(0, 3, 0, 6)};
  // Only what lies wholly between the closure's ends is supported by it.
  EXPECT_EQ(closure_support(map, {0, 4, 5, 9}), (std::vector<std::uint32_t>{0, 0, 1, 0}));
  EXPECT_EQ(closure_support(map, {0, 3, 6, 9}), (std::vector<std::uint32_t>{0, 0, 1, 0}));
  EXPECT_TRUE(closure_support(map, {}).empty());
}

VerdictSet verdicts_of(const SubmapSet& submaps, const test::TestFinder& finder) {
  VerdictSet out;
  for (auto a = submaps.begin(); a != submaps.end(); ++a)
    for (auto b = std::next(a); b != submaps.end(); ++b)
      if (finder.is_candidate(*a->second, *b->second))
        out[{a->first, b->first}] = *finder.verify(*a->second, *b->second, MemoryCloudStore());
  return out;
}

TEST(MonitorGraph, SaysLessWhereClosuresHelp) {
  const test::TestFinder finder(1);
  SubmapSet submaps;
  for (Submap& submap : test::make_submaps(RobotId{0}, {}, Rng(1)))
    submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  const VerdictSet verdicts = verdicts_of(submaps, finder);
  ASSERT_GT(verdicts.size(), 2U);
  const ProxyGraph without = monitor_graph(estimate_map(submaps, {}, {}), 1, {});
  const ProxyGraph with = monitor_graph(estimate_map(submaps, verdicts, {}), 2, {});
  ASSERT_EQ(with.nodes.size(), without.nodes.size());
  EXPECT_TRUE(with.nodes.front().covariance.isZero());
  std::size_t supported = 0;
  for (std::size_t k = 1; k < with.nodes.size(); ++k) {
    EXPECT_EQ(without.nodes[k].support, 0U);
    // Two odometry steps without closures; never more uncertain with them.
    EXPECT_NEAR(without.nodes[k].covariance(3, 3), 2 * 0.005 * 0.005, 1e-7);
    EXPECT_LE(with.nodes[k].covariance.trace(), without.nodes[k].covariance.trace() * (1 + 1e-6));
    if (with.nodes[k].support == 0) continue;
    ++supported;
    EXPECT_LT(with.nodes[k].covariance.trace(), without.nodes[k].covariance.trace());
  }
  EXPECT_GT(supported, 20U);
}

/// Two robots around a circle with closures.
MapEstimate circle_map(std::uint64_t seed) {
  const test::TestFinder finder(seed);
  SubmapSet submaps;
  for (std::uint32_t r = 0; r < 2; ++r)
    for (Submap& submap : test::make_submaps(RobotId{r}, {}, Rng(seed).fork(r)))
      submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  const VerdictSet verdicts = verdicts_of(submaps, finder);
  return estimate_map(submaps, verdicts, {});
}

TEST(MonitorGraph, ARobotWhosePosesAreOpenIsLeftOutAlone) {
  SubmapSet submaps;
  for (const std::uint32_t robot : {0U, 1U, 2U})
    for (Submap& submap : test::make_submaps(RobotId{robot}, {}, Rng(robot)))
      submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  MapEstimate map = estimate_map(submaps, {}, {});
  const ProxyGraph all = monitor_graph(map, 1, {});
  for (std::size_t e = 0; e < map.odometry_edges; ++e)
    if (map.nodes[map.graph.edges[e].from].id.chain.robot == RobotId{1}) map.graph.edges[e].information.setZero();
  const ProxyGraph graph = monitor_graph(map, 1, {});
  const auto of = [](const auto& list, std::uint32_t robot) {
    return std::ranges::count_if(list, [robot](const auto& entry) { return entry.chain.robot == RobotId{robot}; });
  };
  EXPECT_EQ(of(graph.nodes, 1), 0);
  EXPECT_EQ(of(graph.components, 1), 0);
  for (const std::uint32_t robot : {0U, 2U}) {
    EXPECT_EQ(of(graph.nodes, robot), of(all.nodes, robot));
    EXPECT_EQ(of(graph.shapes, robot), 1);
  }
  for (const ProxyNode& node : graph.nodes) EXPECT_TRUE(node.covariance.allFinite());
}

// Of nine submaps the second never arrives, so that the robot's way is in two pieces that nothing joins.
TEST(MonitorGraph, AGapNearTheStartLeavesTheLargerPiece) {
  SubmapSet submaps;
  for (const std::uint32_t robot : {0U, 1U})
    for (Submap& submap : test::make_submaps(RobotId{robot}, {}, Rng(robot)))
      submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  submaps.erase({RobotId{0}, 1});
  const MapEstimate map = estimate_map(submaps, {}, {});
  const ProxyGraph graph = monitor_graph(map, 1, {});
  const auto nodes_of = [&](std::uint32_t robot) {
    return std::ranges::count_if(graph.nodes,
                                 [&](const ProxyNode& node) { return node.chain.robot == RobotId{robot}; });
  };
  EXPECT_EQ(nodes_of(0), 36);  // keyframes 20 .. 90, every other one
  EXPECT_EQ(nodes_of(1), 46);
  EXPECT_EQ(graph.nodes.front().stamp, submaps.at({RobotId{0}, 2})->keyframes.front().stamp);
  ASSERT_EQ(graph.components.size(), 2U);
  EXPECT_EQ(graph.components[0].component, 1U);  // component 0 is the piece left out
  // Closures join the pieces: both are sent.
  const ProxyGraph joined = monitor_graph(estimate_map(submaps, verdicts_of(submaps, test::TestFinder(1)), {}), 2, {});
  EXPECT_EQ(std::ranges::count_if(joined.nodes, [](const ProxyNode& n) { return n.chain.robot == RobotId{0}; }),
            36 + 6);
}

/// `count` nodes of a robot after those it has, of which every `of_each`th is representative.
void append(MapEstimate& map, std::uint32_t robot, std::uint32_t component, int count, int of_each) {
  for (int k = 0; k < count; ++k) {
    const auto index = static_cast<std::uint32_t>(map.nodes.size());
    map.nodes.push_back({.id = {RobotId{robot}, index},
                         .stamp = {1'000'000'000LL * index},
                         .representative = k % of_each == 0,
                         .component = component});
  }
}

TEST(ChooseComponents, MostRepresentativeNodesThenMostNodesThenTheNewest) {
  MapEstimate map;
  append(map, 0, 0, 10, 5);
  append(map, 0, 1, 3, 1);
  append(map, 1, 2, 4, 2);
  append(map, 1, 3, 4, 2);
  append(map, 2, 4, 6, 3);
  append(map, 2, 5, 4, 2);
  const MapComponents chosen = choose_components(map);
  EXPECT_EQ(chosen.of_chain.at(RobotId{0}), 1U);  // 3 of 3 against 2 of 10
  EXPECT_EQ(chosen.of_chain.at(RobotId{1}), 3U);  // equal: the newest
  EXPECT_EQ(chosen.of_chain.at(RobotId{2}), 4U);  // 2 of 6 and 2 of 4
  EXPECT_EQ(chosen.largest, 1U);
  append(map, 3, 2, 1, 1);  // robot 1's smaller piece does not count, though with robot 3 it has three
  EXPECT_EQ(choose_components(map).largest, 1U);
  append(map, 3, 3, 2, 1);  // with robot 1's 2 of 4
  EXPECT_EQ(choose_components(map).largest, 3U);
  EXPECT_TRUE(choose_components({}).of_chain.empty());
}

TEST(MonitorGraph, ShapesAreThoseOfTheNodesSent) {
  const MapEstimate map = circle_map(1);
  const ProxyGraph whole = monitor_graph(map, 1, {});
  EXPECT_EQ(monitor_graph(map, 1, {}), whole);
  ASSERT_EQ(whole.shapes.size(), 2U);
  const ProxyGraph reduced = monitor_graph(map, 1, {.node_budget = 40});
  ASSERT_TRUE(reduced.reduced);
  ASSERT_EQ(reduced.shapes.size(), 2U);
  for (std::uint32_t r = 0; r < 2; ++r) {
    EXPECT_EQ(whole.shapes[r].chain, ChainId(RobotId{r}));
    ASSERT_EQ(whole.shapes[r].sag.size(), 3U);  // 46 nodes
    EXPECT_EQ(whole.shapes[r].sag[0].size(), 5U);
    EXPECT_EQ(reduced.shapes[r].chain, ChainId(RobotId{r}));
    EXPECT_EQ(reduced.shapes[r].sag.size(), 2U);  // 20 nodes
    // The same trajectory, seen at fewer places.
    EXPECT_NEAR(reduced.shapes[r].whole.position_m, whole.shapes[r].whole.position_m,
                0.2 * whole.shapes[r].whole.position_m);
    EXPECT_GT(reduced.shapes[r].sag[0][0].position_m, whole.shapes[r].sag[0][0].position_m);
  }
  EXPECT_TRUE(monitor_graph(map, 1, {.shape_samples = 0}).shapes.empty());
}

// Once around a circle, closures say where the ends lie relative to each other.
TEST(MonitorGraph, TiesWhatClosuresHoldTogether) {
  const MapEstimate map = circle_map(1);
  for (const ShapeUncertainty& shape : monitor_graph(map, 1, {}).shapes) {
    ASSERT_FALSE(shape.ties.empty());
    EXPECT_LE(shape.ties.size(), 32U);
    const bool around =
        std::ranges::any_of(shape.ties, [](const ShapeTie& tie) { return tie.b - tie.a > 30 && tie.b < 46; });
    EXPECT_TRUE(around) << "robot " << shape.chain.robot.value;
  }
  for (const ShapeUncertainty& shape : monitor_graph(map, 1, {.shape_ties = 0}).shapes) EXPECT_TRUE(shape.ties.empty());
}

/// Root mean square of how far one robot's representative nodes lie from where they lie in another map, aligned.
double moved_m(const MapEstimate& map, const MapEstimate& other, RobotId robot) {
  std::vector<Eigen::Vector3d> a, b;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    if (map.nodes[i].id.chain.robot != robot || !map.nodes[i].representative) continue;
    a.push_back(map.nodes[i].T_world_body.translation);
    b.push_back(other.nodes[i].T_world_body.translation);
  }
  const Pose3 T = align_points(a, b);
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - T * b[k]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(a.size()));
}

TEST(MonitorGraph, WhatHingesOnOneClosureIsNotSure) {
  const RobotId robot{0};
  SubmapSet submaps;
  for (Submap& submap : test::make_submaps(robot, {.sigma_m = 0.1, .sigma_rad = 0.02}, Rng(4)))
    submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  const test::TestFinder finder(4);
  const VerdictSet all = verdicts_of(submaps, finder);
  ASSERT_GT(all.size(), 2U);
  const auto expected_m = [](const MapEstimate& map, int deletions) {
    return monitor_graph(map, 1, {.shape_deletions = deletions}).shapes.at(0).whole.position_m;
  };
  const MapEstimate open = estimate_map(submaps, {}, {});
  // A lone closure, and wrong: what it moved the map by is in doubt.
  VerdictSet lone{*all.rbegin()};
  lone.begin()->second.closures[0].measurement.T_a_b.translation.x() += 2.0;
  const MapEstimate bent = estimate_map(submaps, lone, {});
  const double moved = moved_m(bent, open, robot);
  ASSERT_GT(moved, 0.3);
  EXPECT_LT(expected_m(bent, 0), 0.7 * moved);
  EXPECT_NEAR(expected_m(bent, 32), std::hypot(expected_m(bent, 0), moved), 0.2 * moved);
  // Closures that agree: the map moved as far, and is sure of it.
  const MapEstimate closed = estimate_map(submaps, all, {});
  EXPECT_LT(expected_m(closed, 32), 1.5 * expected_m(closed, 0));
}

TEST(MonitorGraph, SaysNothingThatTheMapLeavesOpen) {
  MapEstimate map;
  for (std::uint32_t k = 0; k < 2; ++k)
    map.nodes.push_back({.id = {RobotId{0}, k}, .stamp = {k + 1}, .representative = true});
  map.graph.poses.resize(2);
  map.graph.edges.push_back({0, 1, {}, Matrix6d::Zero()});
  EXPECT_TRUE(monitor_graph(map, 1, {}).nodes.empty());
  EXPECT_TRUE(monitor_graph(map, 1, {}).shapes.empty());
  EXPECT_TRUE(monitor_graph({}, 1, {}).shapes.empty());
}

/// What the estimate of one robot's representative nodes is really off by: positions after alignment, rotations less
/// their mean.
struct TrueErrors {
  std::vector<Eigen::Vector3d> x_m;
  std::vector<Eigen::Vector3d> x_rad;
};

TrueErrors true_errors(const MapEstimate& map, RobotId robot) {
  std::vector<Pose3> truth;
  std::vector<Pose3> estimate;
  std::vector<Eigen::Vector3d> true_points;
  std::vector<Eigen::Vector3d> points;
  for (const MapNode& node : map.nodes) {
    if (node.id.chain.robot != robot || !node.representative) continue;
    truth.push_back(test::true_pose(robot, node.id.index));
    estimate.push_back(node.T_world_body);
    true_points.push_back(truth.back().translation);
    points.push_back(estimate.back().translation);
  }
  const Pose3 T = align_points(true_points, points);
  TrueErrors out;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < truth.size(); ++k) {
    out.x_m.push_back(T * points[k] - true_points[k]);
    out.x_rad.push_back(so3_log(T.rotation * estimate[k].rotation * truth[k].rotation.conjugate()));
    mean += out.x_rad.back() / static_cast<double>(truth.size());
  }
  for (Eigen::Vector3d& turn : out.x_rad) turn -= mean;
  return out;
}

/// Mean of |x|^2 / sigma^2.
struct Ratio {
  void add(const Eigen::Vector3d& x, double sigma) { sum += x.squaredNorm() / (sigma * sigma), ++count; }
  [[nodiscard]] double mean() const { return sum / count; }
  double sum = 0.0;
  int count = 0;
};

TEST(MonitorGraph, TheExpectedErrorIsTheTrueOne) {
  Ratio whole_m, whole_rad;
  std::vector<Ratio> sag_m(3), sag_rad(3);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const MapEstimate map = circle_map(seed);
    for (const ShapeUncertainty& shape : monitor_graph(map, 1, {.shape_samples = 128, .shape_deletions = 0}).shapes) {
      const auto [x_m, x_rad] = true_errors(map, shape.chain.robot);
      for (std::size_t k = 0; k < x_m.size(); ++k) {
        whole_m.add(x_m[k], shape.whole.position_m);
        whole_rad.add(x_rad[k], shape.whole.rotation_rad);
      }
      ASSERT_EQ(shape.sag.size(), 3U);
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t i = 0; i < shape.sag[j].size(); ++i) {
          const std::size_t L = ShapeUncertainty::kShortest << j;
          const std::size_t a = 2 * L * i;
          sag_m[j].add(x_m[a + L] - 0.5 * (x_m[a] + x_m[a + 2 * L]), shape.sag[j][i].position_m);
          sag_rad[j].add(x_rad[a + L] - 0.5 * (x_rad[a] + x_rad[a + 2 * L]), shape.sag[j][i].rotation_rad);
        }
    }
  }
  ASSERT_EQ(whole_m.count, 40 * 46);
  EXPECT_NEAR(std::sqrt(whole_m.mean()), 1.0, 0.2);
  EXPECT_NEAR(std::sqrt(whole_rad.mean()), 1.0, 0.2);
  // Of the sags we know the worst direction: the sum over three is between one and three times its variance
  // (0.9 and 4 with the scatter of 40 stretches).
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_GT(sag_m[j].mean(), 0.9) << j;
    EXPECT_LT(sag_m[j].mean(), 4.0) << j;
    EXPECT_GT(sag_rad[j].mean(), 0.9) << j;
    EXPECT_LT(sag_rad[j].mean(), 4.0) << j;
  }
}

}  // namespace
}  // namespace tutti::server
