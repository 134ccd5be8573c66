// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/graph_judge.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "support/sanitized.hpp"
#include "support/server/corridor_run.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::server {
namespace graph_judge_test {

using test::CorridorRunConfig;

/// Two robots' graph with wrong closures, and which of its edges are wrong.
struct Case {
  RobotGraph graph;
  std::vector<bool> wrong;
  std::vector<Pose3> truth;
};

Case make_case(const CorridorRunConfig& config, std::uint64_t seed) {
  const test::CorridorRun run = test::corridor_run(config, seed);
  Case out;
  const auto position = [&](const KeyframeId& id) {
    return static_cast<std::size_t>(std::ranges::lower_bound(out.graph.vertices, id) - out.graph.vertices.begin());
  };
  for (const auto& [id, submap] : run.submaps)
    for (const Keyframe& k : submap->keyframes)
      if (out.graph.vertices.empty() || out.graph.vertices.back() < KeyframeId{id.chain, k.index}) {
        out.graph.vertices.push_back({id.chain, k.index});
        out.graph.stamps.push_back(k.stamp);
        out.truth.push_back(run.true_poses.at(out.graph.vertices.back()));
      }
  out.graph.graph.poses.resize(out.graph.vertices.size());
  const auto add = [&](const KeyframeId& from, const KeyframeId& to, const RelativePose& measured, bool wrong) {
    out.graph.graph.edges.push_back({position(from), position(to), measured.T_a_b, inverse_of(measured.covariance)});
    out.wrong.push_back(wrong);
  };
  for (const auto& [id, submap] : run.submaps)
    for (std::size_t k = 0; k < submap->odometry.size(); ++k)
      add({id.chain, submap->keyframes[k].index}, {id.chain, submap->keyframes[k + 1].index}, submap->odometry[k],
          false);
  for (const auto& [pair, verdict] : run.verdicts)
    for (const LoopClosure& c : verdict.closures) add(c.from, c.to, c.measurement, test::is_wrong(run, c));
  return out;
}

double rmse(const Case& of, const MapEstimate& map) {
  std::vector<Eigen::Vector3d> truth, estimate;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    truth.push_back(of.truth[i].translation);
    estimate.push_back(map.nodes[i].T_world_body.translation);
  }
  const Pose3 T = align_points(truth, estimate);
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) sum += (truth[i] - T * estimate[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

CorridorRunConfig with_wrong_closures() {
  CorridorRunConfig config;
  config.closures.wrong_share = 0.2;
  return config;
}

TEST(GraphJudge, DistinguishesWrongClosuresFromRightOnes) {
  const Case of = make_case(with_wrong_closures(), 1);
  const JudgedGraph judged = judge_graph(of.graph, {});
  ASSERT_TRUE(judged.map.converged);
  ASSERT_EQ(judged.edges.size(), of.wrong.size());
  EXPECT_EQ(judged.map.nodes.size(), of.graph.vertices.size());
  std::size_t right = 0, kept = 0;
  for (std::size_t e = 0; e < of.wrong.size(); ++e) {
    const JudgedEdge& edge = judged.edges[e];
    EXPECT_EQ(edge.odometry, e < judged.map.odometry_edges);
    EXPECT_EQ(edge.accepted, edge.objection == judge::Objection::none);
    EXPECT_FALSE(of.wrong[e] && edge.accepted);
    right += !of.wrong[e] && !edge.odometry ? 1U : 0U;
    kept += edge.accepted && !edge.odometry ? 1U : 0U;
  }
  EXPECT_GT(kept, 95 * right / 100);
  EXPECT_LT(rmse(of, judged.map), 0.2);
}

TEST(GraphJudge, HowAnEdgeIsWrittenDoesNotMatter) {
  const Case of = make_case(with_wrong_closures(), 2);
  const JudgedGraph judged = judge_graph(of.graph, {});
  Case other = of;
  std::ranges::reverse(other.graph.graph.edges);
  for (std::size_t e = 0; e < other.graph.graph.edges.size(); e += 2) {
    PoseGraphEdge& edge = other.graph.graph.edges[e];
    const RelativePose turned = inverse({edge.T_from_to, inverse_of(edge.information)});
    edge = {edge.to, edge.from, turned.T_a_b, inverse_of(turned.covariance)};
  }
  const JudgedGraph again = judge_graph(other.graph, {});
  for (std::size_t e = 0; e < of.wrong.size(); ++e) {
    const JudgedEdge& a = judged.edges[e];
    const JudgedEdge& b = again.edges[of.wrong.size() - 1 - e];
    EXPECT_EQ(a.odometry, b.odometry) << e;
    EXPECT_EQ(a.accepted, b.accepted) << e;
  }
  EXPECT_NEAR(rmse(of, judged.map), rmse(of, again.map), 1e-4);
}

TEST(GraphJudge, OdometryThatFailedIsFoundAndAGapIsNone) {
  CorridorRunConfig config = with_wrong_closures();
  config.failures = {test::failure(0, 170, 172, 1.5, 1.5, 20)};
  Case of = make_case(config, 1);
  const std::size_t last = of.graph.vertices.size() - 10;  // of the second robot
  const std::size_t gap = static_cast<std::size_t>(std::ranges::find(of.graph.graph.edges, last, &PoseGraphEdge::to) -
                                                   of.graph.graph.edges.begin());
  of.graph.graph.edges.erase(of.graph.graph.edges.begin() + static_cast<std::ptrdiff_t>(gap));
  const JudgedGraph judged = judge_graph(of.graph, {});
  ASSERT_FALSE(judged.map.failed_odometry.empty());
  for (const FailedOdometry& failed : judged.map.failed_odometry) EXPECT_EQ(failed.chain, ChainId(RobotId{0}));
  EXPECT_EQ(judged.map.nodes.size(), of.graph.vertices.size());
  EXPECT_EQ(judged.map.odometry_edges, of.graph.vertices.size() - 3);  // two robots and a gap
}

/// By how much the poses of a map cost more than those of the same factors solved from their measurements alone.
double too_dear(const MapEstimate& map) {
  estimation::SolverConfig precisely;
  precisely.relative_cost_tolerance = 1e-12;
  const auto anew = estimation::solve_pose_graph(map.graph, precisely);
  EXPECT_TRUE(estimation::is_usable(anew.summary.termination));
  return estimation::chi2(map.graph) / std::max(anew.summary.final_cost, 1.0) - 1.0;
}

// Wrong factors lead the search astray, and poses that it leaves may lie in a basin of their own. So the same factors
// must not be cheaper from their measurements, whatever came before: with many wrong closures, with odometry that
// fails, and with the first closures of a fleet as with all of them.
TEST(GraphJudge, ThePosesCostNoMoreThanTheSameFactorsFromTheirMeasurements) {
  for (std::uint64_t seed = 1; seed <= tutti::seeds(std::uint64_t{4}); ++seed) {
    CorridorRunConfig config = with_wrong_closures();
    config.closures.wrong_share = 0.1 * static_cast<double>(seed);
    if (seed % 2 == 0) config.failures = {test::failure(0, 170, 172, 1.5, 1.5, 20)};
    const Case of = make_case(config, seed);
    const std::size_t odometry = of.graph.vertices.size() - 2;
    for (std::size_t known = odometry; known <= of.graph.graph.edges.size(); known += 120) {
      RobotGraph some = of.graph;
      some.graph.edges.resize(known);
      const MapEstimate map = judge_graph(some, {}).map;
      ASSERT_TRUE(map.converged);
      if (!map.failed_odometry.empty()) continue;  // its graph is weakened where it failed, after it was solved
      EXPECT_LT(too_dear(map), 1e-5) << "seed " << seed << ", " << known << " edges";
      EXPECT_NEAR(map.cost, estimation::chi2(map.graph), 1e-6 * map.cost + 1e-6);
      EXPECT_EQ(map.degrees_of_freedom, 6 * (map.graph.edges.size() + map.components - map.nodes.size()));
    }
  }
}

TEST(GraphJudge, RobotsThatNeverMeetStayApart) {
  RobotGraph graph;
  for (std::uint32_t robot = 0; robot < 2; ++robot)
    for (std::uint32_t k = 0; k < 3; ++k) {
      graph.vertices.push_back({RobotId{robot}, k});
      graph.stamps.push_back(Timestamp{} + k);
      graph.graph.poses.emplace_back();
      if (k > 0)
        graph.graph.edges.push_back({graph.graph.poses.size() - 2, graph.graph.poses.size() - 1,
                                     Pose3{Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}},
                                     100.0 * Matrix6d::Identity()});
    }
  const JudgedGraph judged = judge_graph(graph, {});
  EXPECT_TRUE(judged.map.converged);
  EXPECT_EQ(judged.map.components, 2U);
  EXPECT_NEAR(judged.map.nodes[5].T_world_body.translation.x(), 2.0, 1e-9);
}

}  // namespace graph_judge_test
}  // namespace tutti::server
