// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/graph_monitor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "support/server/world.hpp"
#include "tutti/consistency/disagreement.hpp"
#include "tutti/consistency/signal.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/server/map_components.hpp"

namespace tutti::server {
namespace graph_monitor_test {

VerdictSet verdicts_of(const SubmapSet& submaps, const test::TestVerifier& verifier) {
  VerdictSet out;
  for (auto a = submaps.begin(); a != submaps.end(); ++a)
    for (auto b = std::next(a); b != submaps.end(); ++b)
      if (verifier.is_candidate(*a->second, *b->second))
        out[{a->first, b->first}] = *verifier.verify(*a->second, *b->second, MemoryPayloadStore());
  return out;
}

TEST(MonitorGraph, SaysLessWhereClosuresHelp) {
  const test::TestVerifier verifier(1);
  SubmapSet submaps;
  for (Submap& submap : test::make_submaps(RobotId{0}, {}, Rng(1)))
    submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  const VerdictSet verdicts = verdicts_of(submaps, verifier);
  ASSERT_GT(verdicts.size(), 2U);
  const ProxyGraph without = monitor_graph(estimate_map(submaps, {}, {}), 1, {});
  const ProxyGraph with = monitor_graph(estimate_map(submaps, verdicts, {}), 2, {});
  ASSERT_EQ(with.nodes.size(), without.nodes.size());
  EXPECT_TRUE(with.nodes.front().covariance.isZero());
  std::size_t surer = 0;
  for (std::size_t k = 1; k < with.nodes.size(); ++k) {
    // Two odometry steps without closures; never more uncertain with them.
    EXPECT_NEAR(without.nodes[k].covariance(3, 3), 2 * 0.005 * 0.005, 1e-7);
    const double ratio = with.nodes[k].covariance.trace() / without.nodes[k].covariance.trace();
    EXPECT_LE(ratio, 1 + 1e-6);
    if (ratio < 0.999) ++surer;
  }
  EXPECT_GT(surer, 20U);
}

/// Robots around a circle with closures.
MapEstimate circle_map(std::uint64_t seed, std::uint32_t robots = 2) {
  const test::TestVerifier verifier(seed);
  SubmapSet submaps;
  for (std::uint32_t r = 0; r < robots; ++r)
    for (Submap& submap : test::make_submaps(RobotId{r}, {}, Rng(seed).fork(r)))
      submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  const VerdictSet verdicts = verdicts_of(submaps, verifier);
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
    EXPECT_EQ(of(graph.uncertainties, robot), 1);
  }
  for (const ProxyNode& node : graph.nodes) EXPECT_TRUE(node.covariance.allFinite());
}

// The second of nine submaps never arrives, so that the robot's trajectory is in two segments that nothing joins.
TEST(MonitorGraph, AGapNearTheStartLeavesTheLargerSegment) {
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
  EXPECT_EQ(graph.components[0].component, 1U);  // component 0 is the segment left out
  // Closures join the segments: both are sent.
  const ProxyGraph joined = monitor_graph(estimate_map(submaps, verdicts_of(submaps, test::TestVerifier(1)),
                                                       {.outlier_rejection = {.min_joining_closures = 2}}),
                                          2, {});
  EXPECT_EQ(std::ranges::count_if(joined.nodes, [](const ProxyNode& n) { return n.chain.robot == RobotId{0}; }),
            36 + 6);
  ASSERT_EQ(joined.uncertainties.size(), 2U);
  // Odometry says nothing of how the segments lie to each other.
  EXPECT_FALSE(joined.uncertainties[0].directions.empty());
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
  append(map, 3, 2, 1, 1);  // robot 1's smaller segment does not count, though with robot 3 it has three
  EXPECT_EQ(choose_components(map).largest, 1U);
  append(map, 3, 3, 2, 1);  // with robot 1's 2 of 4
  EXPECT_EQ(choose_components(map).largest, 3U);
  EXPECT_TRUE(choose_components({}).of_chain.empty());
}

TEST(MonitorGraph, UncertaintiesAreThoseOfTheNodesSent) {
  const MapEstimate map = circle_map(1);
  const ProxyGraph whole = monitor_graph(map, 1, {});
  EXPECT_EQ(monitor_graph(map, 1, {}), whole);  // a function of the map
  ASSERT_EQ(whole.uncertainties.size(), 2U);
  const ProxyGraph reduced = monitor_graph(map, 1, {.node_budget = 40});
  ASSERT_TRUE(reduced.reduced);
  ASSERT_EQ(reduced.uncertainties.size(), 2U);
  const auto sigmas = [](const ChainUncertainty& u) {
    std::size_t out = 0;
    for (const ScaleUncertainty& scale : u.scales) out = std::max(out, scale.sigma.size());
    return out;
  };
  for (std::uint32_t r = 0; r < 2; ++r) {
    EXPECT_EQ(whole.uncertainties[r].chain, ChainId(RobotId{r}));
    EXPECT_EQ(sigmas(whole.uncertainties[r]), 5U);  // 46 nodes
    EXPECT_EQ(reduced.uncertainties[r].chain, ChainId(RobotId{r}));
    EXPECT_EQ(sigmas(reduced.uncertainties[r]), 2U);  // 20 nodes
    // The same trajectory, seen at fewer places.
    EXPECT_NEAR(reduced.uncertainties[r].whole.position_m, whole.uncertainties[r].whole.position_m,
                0.2 * whole.uncertainties[r].whole.position_m);
  }
  EXPECT_TRUE(monitor_graph(map, 1, {.shape_samples = 0}).uncertainties.empty());
}

// Once around a circle, closures say where the ends lie relative to each other; without them odometry is all there is.
// A robot starts a session at every change of its battery: earlier ones stay in the map, and cost no samples.
TEST(MonitorGraph, OnlyTheSessionsThatHearItAreSampled) {
  const ChainId first(RobotId{0}), second{RobotId{0}, 1}, other(RobotId{1});
  MapEstimate map = circle_map(1);
  map.overstated.clear();  // by chain
  MonitorWork of_robots, of_sessions;
  const ProxyGraph robots = monitor_graph(map, 1, {}, {}, &of_robots);
  for (MapNode& node : map.nodes)
    if (node.id.chain == other) node.id.chain = second;
  const ProxyGraph sessions = monitor_graph(map, 1, {}, {}, &of_sessions);
  ASSERT_EQ(sessions.nodes.size(), robots.nodes.size());
  EXPECT_EQ(robots.uncertainties.size(), 2U);
  ASSERT_EQ(sessions.uncertainties.size(), 1U);
  EXPECT_EQ(sessions.uncertainties[0].chain, second);
  EXPECT_EQ(sessions.uncertainties[0].scales, robots.uncertainties[1].scales);  // nothing else changes
  EXPECT_EQ(2 * of_sessions.products, of_robots.products);
  const ProxyGraph owned = monitor_graph(map, 1, {}, std::vector{first});  // its robot goes on in the first session
  ASSERT_EQ(owned.uncertainties.size(), 1U);
  EXPECT_EQ(owned.uncertainties[0].chain, first);
  ASSERT_EQ(owned.last_seen.size(), 1U);
  EXPECT_EQ(owned.last_seen[0].chain, first);
}

TEST(MonitorGraph, DirectionsAreWhatClosuresKnow) {
  for (const ChainUncertainty& u : monitor_graph(circle_map(1), 1, {}).uncertainties) {
    EXPECT_FALSE(u.directions.empty()) << to_string(u.chain);
    EXPECT_LE(u.directions.size(), 4U);
    for (const KnownDirection& direction : u.directions) EXPECT_EQ(direction.position.size(), 3U * 23U);
  }
  SubmapSet submaps;
  for (Submap& submap : test::make_submaps(RobotId{0}, {}, Rng(1)))
    submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  const ProxyGraph open = monitor_graph(estimate_map(submaps, {}, {}), 1, {});
  ASSERT_EQ(open.uncertainties.size(), 1U);
  EXPECT_TRUE(open.uncertainties[0].directions.empty());
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

TEST(MonitorGraph, WhatHangsOnOneClosureThatOdometryContradictsIsDoubted) {
  const RobotId robot{0};
  SubmapSet submaps;
  for (Submap& submap : test::make_submaps(robot, {.sigma_m = 0.1, .sigma_rad = 0.02}, Rng(4)))
    submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  const test::TestVerifier verifier(4);
  const VerdictSet all = verdicts_of(submaps, verifier);
  ASSERT_GT(all.size(), 2U);
  const auto doubted_m = [](const MapEstimate& map, int deletions) {
    const auto doubted = monitor_graph(map, 1, {.shape_deletions = deletions}).uncertainties.at(0).doubted;
    return doubted ? doubted->sigma : 0.0;
  };
  VerdictSet lone{*all.rbegin()};
  lone.begin()->second.closures[0].measurement.T_a_b.translation.x() += 6.0;
  const MapEstimate bent = estimate_map(submaps, lone, {});
  const double moved = moved_m(bent, estimate_map(submaps, {}, {}), robot);
  ASSERT_GT(moved, 0.3);
  EXPECT_GT(doubted_m(bent, 32), 0.3 * moved);
  EXPECT_EQ(doubted_m(bent, 0), 0.0);
  // Closures that agree: little hangs on any one of them.
  EXPECT_LT(doubted_m(estimate_map(submaps, all, {}), 32), 0.1 * doubted_m(bent, 32));
}

// However many closures two places that look alike make, they are one witness.
TEST(MonitorGraph, WhatHangsOnOnePairOfPlacesIsDoubtedHoweverManyClosuresItMade) {
  const RobotId robot{0};
  SubmapSet submaps;
  for (Submap& submap : test::make_submaps(robot, {.sigma_m = 0.1, .sigma_rad = 0.02}, Rng(4)))
    submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  VerdictSet lone{*verdicts_of(submaps, test::TestVerifier(4)).rbegin()};
  std::vector<LoopClosure>& closures = lone.begin()->second.closures;
  closures[0].measurement.T_a_b.translation.x() += 9.0;
  const auto pose = [&](const KeyframeId& id) {
    for (const auto& [key, submap] : submaps)
      for (const Keyframe& keyframe : submap->keyframes)
        if (id == KeyframeId{key.chain, keyframe.index}) return keyframe.T_odom_body;
    throw std::logic_error("no such keyframe");
  };
  const auto doubted_m = [&] {
    const auto doubted = monitor_graph(estimate_map(submaps, lone, {}), 1, {}).uncertainties.at(0).doubted;
    return doubted ? doubted->sigma : 0.0;
  };
  const double of_one = doubted_m();
  ASSERT_GT(of_one, 0.1);
  const LoopClosure first = closures[0];
  for (int k = 1; k <= 2; ++k) {  // those of the next keyframes say the same
    LoopClosure next = first;
    next.from.index += k;
    next.to.index += k;
    next.measurement.T_a_b = pose(next.from).inverse() * pose(first.from) * first.measurement.T_a_b *
                             pose(first.to).inverse() * pose(next.to);
    closures.push_back(next);
  }
  EXPECT_GT(doubted_m(), 0.5 * of_one);
}

TEST(MonitorGraph, SaysNothingThatTheMapLeavesOpen) {
  MapEstimate map;
  for (std::uint32_t k = 0; k < 2; ++k)
    map.nodes.push_back({.id = {RobotId{0}, k}, .stamp = {k + 1}, .representative = true});
  map.graph.poses.resize(2);
  map.graph.edges.push_back({0, 1, {}, Matrix6d::Zero()});
  EXPECT_TRUE(monitor_graph(map, 1, {}).nodes.empty());
  EXPECT_TRUE(monitor_graph(map, 1, {}).uncertainties.empty());
  EXPECT_TRUE(monitor_graph({}, 1, {}).uncertainties.empty());
}

/// The truth of one robot's nodes, as a robot that never errs would know it.
struct TrueRobot {
  std::vector<Pose3> truth, server;
  std::vector<consistency::NodePair> pairs;
};

TrueRobot true_robot(const ProxyGraph& graph, const ChainId& chain) {
  TrueRobot out;
  for (std::size_t n = 0; n < graph.nodes.size(); ++n) {
    const ProxyNode& node = graph.nodes[n];
    if (node.chain != chain) continue;
    const auto index = static_cast<std::uint32_t>(node.stamp.ns / 1'000'000'000 - 1);
    out.pairs.push_back({.proxy = n, .robot = out.pairs.size()});
    out.truth.push_back(test::true_pose(chain.robot, index));
    out.server.push_back(node.T_world_body);
  }
  return out;
}

struct Mean {
  void add(double value) { sum += value, ++count; }
  [[nodiscard]] double operator()() const { return sum / count; }
  double sum = 0.0;
  int count = 0;
};

/// The true errors of many maps over those that each states.
struct Calibration {
  Mean whole_m, whole_rad;                             ///< Squares.
  std::array<Mean, 4> coefficient_m, coefficient_rad;  ///< Per scale.
  int robots = 0, rejected = 0;
};

/// Sees the map's errors as a robot sees them that knows the truth.
void add_errors(const ProxyGraph& graph, const ChainUncertainty& u, Calibration& out) {
  const TrueRobot robot = true_robot(graph, u.chain);
  const Eigen::MatrixXd off = consistency::pose_difference(robot.server, robot.truth);
  const auto nodes = static_cast<double>(off.rows());
  out.whole_m.add(off.leftCols<3>().squaredNorm() / nodes / std::pow(u.whole.position_m, 2));
  out.whole_rad.add(off.rightCols<3>().squaredNorm() / nodes / std::pow(u.whole.rotation_rad, 2));
  const consistency::DisagreementTest test(graph, u.chain, robot.pairs, {.false_alarm_rate = 0.01});
  const consistency::Disagreement found = test(robot.truth);
  ++out.robots;
  out.rejected += found.disagrees() ? 1 : 0;
  for (std::size_t s = 0; s < u.scales.size(); ++s) {
    const ScaleUncertainty& scale = u.scales[s];
    if (scale.sigma.empty()) continue;
    Eigen::ArrayXd m = found.position_m.col(static_cast<Eigen::Index>(s)).array();
    Eigen::ArrayXd rad = found.rotation_rad.col(static_cast<Eigen::Index>(s)).array();
    for (Eigen::Index n = 0; n < m.size(); ++n) {
      const PoseSigma& sigma = scale.sigma[static_cast<std::size_t>(n) / ChainUncertainty::kBlock];
      m(n) /= sigma.position_m;
      rad(n) /= sigma.rotation_rad;
    }
    out.coefficient_m[s].add(m.square().mean());
    out.coefficient_rad[s].add(rad.square().mean());
  }
}

void expect_calibrated(const Calibration& found) {
  ASSERT_EQ(found.robots, 40);
  EXPECT_NEAR(std::sqrt(found.whole_m()), 1.0, 0.2);
  EXPECT_NEAR(std::sqrt(found.whole_rad()), 1.0, 0.2);
  int said = 0;
  for (std::size_t s = 0; s < 4; ++s) {
    if (found.coefficient_m[s].count == 0) continue;
    ++said;
    // The worst direction of the worst of ten nodes has between a third and all of what three axes have together.
    for (const Mean& coefficient : {found.coefficient_m[s], found.coefficient_rad[s]}) {
      EXPECT_GT(coefficient(), 0.5) << s;
      EXPECT_LT(coefficient(), 3.0) << s;
    }
  }
  EXPECT_GE(said, 3);
}

TEST(MonitorGraph, TheExpectedErrorIsTheTrueOne) {
  Calibration alone, together;
  for (std::uint64_t seed = 0; seed < 40; ++seed)
    for (const std::uint32_t robots : {1U, 2U}) {
      if (robots == 2 && seed >= 20) continue;
      const ProxyGraph graph = monitor_graph(circle_map(seed, robots), 1, {.shape_deletions = 0});
      for (const ChainUncertainty& u : graph.uncertainties) add_errors(graph, u, robots == 1 ? alone : together);
    }
  expect_calibrated(alone);
  expect_calibrated(together);
  std::printf("[ MEASURED ] the truth rejected at 1 %%: %d of 40 alone, %d of 40 together\n", alone.rejected,
              together.rejected);
  EXPECT_LE(alone.rejected, 2);
  EXPECT_LE(together.rejected, 2);
}

}  // namespace graph_monitor_test
}  // namespace tutti::server
