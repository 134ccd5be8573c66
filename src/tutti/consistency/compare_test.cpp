// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/compare.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>

#include "support/consistency/runs.hpp"
#include "support/shared_data.hpp"
#include "tutti/spectral/graph.hpp"
#include "tutti/spectral/spectrum.hpp"

namespace tutti::consistency {
namespace compare_test {

using test::kAlpha, test::kBravo;

double largest(const Comparison& comparison) { return comparison.disagreement.cwiseAbs().maxCoeff(); }

/// Sums over the groups large, mid, small at one node.
Eigen::Vector3d groups(const Comparison& c, Eigen::Index node) {
  return {c.disagreement.row(node).head(2).sum(), c.disagreement.row(node).segment(2, 2).sum(),
          c.disagreement.row(node).tail(3).sum()};
}

RC_GTEST_PROP(Compare, EqualMapsAgreeWhereverTheyAre, (std::uint64_t seed)) {
  Rng rng(seed);
  const auto poses = test::server_estimate(test::corridor(150), {}, rng.fork("server"));
  const std::string reducer = *rc::gen::element<std::string>("none", "budget", "paper");
  const ProxyGraphConfig graph_config{.node_budget = reducer == "none" ? 0 : 70,
                                      .reducer = reducer == "none" ? "budget" : reducer,
                                      .sparsify_threshold = *rc::gen::element(0.0, 1e-3, 3e-2)};
  const CompareConfig config{.signal = *rc::gen::element<std::string>("distance", "relative_motion"),
                             .exact = *rc::gen::arbitrary<bool>()};
  const auto graph = test::proxy_graph(poses, graph_config);
  const auto nodes = test::robot_nodes(test::moved(test::random_pose(rng, 100.0), poses));
  const auto comparison = compare(graph, kAlpha, nodes, config);
  RC_ASSERT(comparison.pairs.size() == graph.nodes.size());
  RC_ASSERT(comparison.disagreement.rows() == static_cast<Eigen::Index>(graph.nodes.size()));
  RC_ASSERT(comparison.disagreement.cols() == 7);
  RC_ASSERT(graph.reduced == (reducer != "none"));
  RC_ASSERT(largest(comparison) < 1e-8);
}

TEST(Compare, ADiscontinuityIsFoundByTheSmallScales) {
  const auto poses = test::corridor(200);
  auto bent = poses;
  bent[90].translation += bent[90].rotation * Eigen::Vector3d(0.3, 0.0, 0.0);  // along the path: visible in a distance
  for (const int budget : {0, 150}) {
    const auto comparison =
        compare(test::proxy_graph(poses, {.node_budget = budget}), kAlpha, test::robot_nodes(bent), {});
    Eigen::Index where = 0;
    comparison.disagreement.rightCols(3).rowwise().sum().maxCoeff(&where);
    const std::size_t node = comparison.pairs[static_cast<std::size_t>(where)].robot;
    EXPECT_NEAR(static_cast<double>(node), 90.0, budget == 0 ? 0.0 : 2.0);
    EXPECT_GT(groups(comparison, where)(2), 0.1);
    EXPECT_LT(groups(comparison, 10)(2), 0.02);
  }
}

TEST(Compare, ASlowSegmentIsSeenInTheLargeScales) {
  const auto poses = test::corridor(200);
  auto segmented = poses;
  for (Pose3& pose : segmented) pose.translation *= 1.01;
  const auto comparison = compare(test::proxy_graph(poses), kAlpha, test::robot_nodes(segmented), {});
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index n = 0; n < 200; ++n) sum += groups(comparison, n);
  EXPECT_GT(sum(0), 3.0 * sum(1));
  EXPECT_GT(sum(0), 10.0 * sum(2));
  EXPECT_GT(sum(0) / 200, 0.3);
}

TEST(Compare, OtherRobotsDoNotMatter) {
  Rng rng(4);
  const auto poses = test::corridor(120);
  const auto drifted = test::integrate({}, test::odometry_increments(poses, {}, rng.fork("odometry")));
  auto both = test::server_nodes(kAlpha, poses);
  const auto bravo = test::server_nodes(kBravo, test::corridor(90));  // the same corridors at the same times
  both.insert(both.begin(), bravo.begin(), bravo.end());
  const auto alone = compare(test::proxy_graph(poses), kAlpha, test::robot_nodes(drifted), {});
  auto graph = build_proxy_graph(1, both, {}, {});
  EXPECT_EQ(compare(graph, kAlpha, test::robot_nodes(drifted), {}).disagreement, alone.disagreement);
  std::reverse(graph.nodes.begin(), graph.nodes.end());
  EXPECT_EQ(compare(graph, kAlpha, test::robot_nodes(drifted), {}).disagreement, alone.disagreement);
}

TEST(Compare, ChebyshevKeepsTheTolerance) {
  Rng rng(5);
  const auto truth = test::corridor(400);
  const auto drifted =
      test::integrate({}, test::odometry_increments(truth, {.rotation_rad = 2e-3}, rng.fork("odometry")));
  const auto server = test::server_estimate(truth, {}, rng.fork("server"));
  for (const int budget : {0, 250})
    for (const char* signal : {"distance", "relative_motion"}) {
      const auto graph = test::proxy_graph(server, {.node_budget = budget});
      const auto exact = compare(graph, kAlpha, test::robot_nodes(drifted), {.signal = signal, .exact = true});
      EXPECT_EQ(exact.order, 0);
      for (const double tolerance : {1e-2, 1e-3, 1e-5}) {
        const auto fast =
            compare(graph, kAlpha, test::robot_nodes(drifted), {.signal = signal, .tolerance_m = tolerance});
        EXPECT_LE((fast.disagreement - exact.disagreement).cwiseAbs().maxCoeff(), tolerance);
        EXPECT_GT(fast.order, 0);
      }
    }
}

TEST(Compare, FewerThanTwoPairs) {
  const auto poses = test::corridor(5);
  const auto graph = test::proxy_graph(poses);
  EXPECT_EQ(compare({}, kAlpha, {}, {}).disagreement.rows(), 0);
  EXPECT_EQ(compare(graph, kBravo, test::robot_nodes(poses), {}).pairs.size(), 0U);
  const auto one = compare(graph, kAlpha, test::robot_nodes({poses[0]}), {});
  ASSERT_EQ(one.disagreement.rows(), 1);
  EXPECT_EQ(largest(one), 0.0);
}

TEST(Compare, NodesOutOfReachOfEachOtherDisagreeInScaleZeroOnly) {
  std::vector<Pose3> far{test::at(0, 0, 0), test::at(100, 0, 0), test::at(0, 100, 0)};
  auto moved = far;
  moved[2].translation.y() = 101.0;
  const auto comparison = compare(test::proxy_graph(far), kAlpha, test::robot_nodes(moved), {});
  EXPECT_EQ(comparison.lambda_max, 0.0);
  EXPECT_NEAR(comparison.disagreement(2, 0), 1.0, 1e-12);
  EXPECT_LT(comparison.disagreement.rightCols(6).maxCoeff(), 1e-12);
}

TEST(Compare, DisconnectedPartsOfEqualMapsAgree) {
  auto poses = test::corridor(60);
  for (std::size_t n = 30; n < 60; ++n) poses[n].translation.z() += 500.0;
  for (const int budget : {0, 30}) {
    const auto comparison =
        compare(test::proxy_graph(poses, {.node_budget = budget}), kAlpha, test::robot_nodes(poses), {});
    EXPECT_LT(largest(comparison), 1e-9);
    EXPECT_GT(comparison.lambda_max, 0.0);
  }
}

// Nodes missing on either side drop out on both: what is left still agrees exactly as long as nothing was reduced.
TEST(Compare, MissingNodesDropOutOnBothSides) {
  const auto poses = test::corridor(90);
  auto nodes = test::robot_nodes(poses);
  nodes.erase(nodes.begin() + 20, nodes.begin() + 26);
  nodes.push_back({.stamp = test::stamp_of(500), .chain_index = 1500, .submap = 9});
  const auto plain = compare(test::proxy_graph(poses), kAlpha, nodes, {});
  EXPECT_EQ(plain.pairs.size(), 84U);
  EXPECT_LT(largest(plain), 1e-9);

  const auto reduced = compare(test::proxy_graph(poses, {.node_budget = 45}), kAlpha, nodes, {});
  // Without them the two graphs differ, and so do the coefficients of equal maps: least in the smallest scale.
  const auto smallest = reduced.disagreement.col(6);
  EXPECT_GT(smallest.head(25).maxCoeff(), 10.0 * smallest.tail(10).maxCoeff());
}

TEST(Compare, AnUnknownSignalIsOurOwnMistake) {
  const auto poses = test::corridor(5);
  EXPECT_THROW(compare(test::proxy_graph(poses), kAlpha, test::robot_nodes(poses), {.signal = "loudness"}),
               std::logic_error);
}

// One graph, two signals: what differs at one node sits in the small scales there, what differs slowly in the large.
TEST(Disagreement, SortsDifferencesByScale) {
  std::vector<Eigen::Vector3d> positions;
  for (const Pose3& pose : test::corridor(200)) positions.push_back(pose.translation);
  const auto L = spectral::laplacian(spectral::proximity_adjacency(positions, 7.0, 1.0));
  const double lambda_max = spectral::largest_eigenvalue(L);
  const Eigen::MatrixXd f = Eigen::VectorXd::LinSpaced(200, 0.0, 199.0);
  Eigen::MatrixXd discontinuity = f, drift = f;
  discontinuity(90, 0) += 0.3;
  for (Eigen::Index n = 0; n < 200; ++n) drift(n, 0) += 0.3 * std::sin(static_cast<double>(n) / 40.0);
  Comparison comparison;
  comparison.disagreement = disagreement({L, f, lambda_max}, {L, discontinuity, lambda_max}, {}, comparison.order);
  EXPECT_GT(groups(comparison, 90)(2), 5.0 * groups(comparison, 90)(0));
  EXPECT_GT(groups(comparison, 90)(2), 10.0 * groups(comparison, 80)(2));
  comparison.disagreement = disagreement({L, f, lambda_max}, {L, drift, lambda_max}, {}, comparison.order);
  for (const Eigen::Index n : {50, 60, 70}) {
    EXPECT_GT(groups(comparison, n)(0), 5.0 * groups(comparison, n)(1));
    EXPECT_GT(groups(comparison, n)(0), 20.0 * groups(comparison, n)(2));
  }
}

// Two nodes: the mean passes scale 0, the difference sits at lambda_max where only the smallest scale passes.
TEST(Disagreement, OfTwoNodesByHand) {
  const std::vector<spectral::WeightedEdge> edges{{0, 1, 0.7}};
  const auto L = spectral::laplacian(spectral::adjacency_from_edges(2, edges));
  int order = -1;
  const auto d = disagreement({L, Eigen::Vector2d(0, 3), 1.4}, {L, Eigen::Vector2d(0, 1), 1.4}, {.exact = true}, order);
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(2, 7);
  expected.col(0).setOnes();
  expected.col(6).setOnes();
  EXPECT_LT((d - expected).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_EQ(order, 0);
}

TEST(Disagreement, SumsTheColumnsOfASignalInSquares) {
  const std::vector<spectral::WeightedEdge> edges{{0, 1, 1.0}};
  const auto L = spectral::laplacian(spectral::adjacency_from_edges(2, edges));
  const Eigen::MatrixXd f = (Eigen::MatrixXd(2, 2) << 3, 4, 3, 4).finished();
  int order = 0;
  const auto d = disagreement({L, f, 2.0}, {L, Eigen::MatrixXd::Zero(2, 2), 2.0}, {.scales = 3}, order);
  EXPECT_LT((d.col(0) - Eigen::Vector2d(5, 5)).norm(), 1e-9);
}

TEST(Golden, DisagreementOnOneGraphIsPyGsps) {
  for (const char* file : {"golden/a_path12.json", "golden/b_geo40.json", "golden/c7_two_loop120_r7.json"}) {
    TUTTI_REQUIRE_SHARED(file);
    std::ifstream stream(tutti::test::shared_path(file));
    const auto golden = nlohmann::json::parse(stream);
    const auto n = golden["n"].get<Eigen::Index>();
    std::vector<spectral::WeightedEdge> edges;
    for (int a = 0; a < n; ++a)
      for (int b = a + 1; b < n; ++b)
        if (const double w = golden["W"][static_cast<std::size_t>(a)][static_cast<std::size_t>(b)]; w > 0)
          edges.push_back({a, b, w});
    const auto L = spectral::laplacian(spectral::adjacency_from_edges(static_cast<int>(n), edges));
    const auto f = golden["signal_f"].get<std::vector<double>>();
    const auto g = golden["signal_f_perturbed"].get<std::vector<double>>();
    const Eigen::MatrixXd f_server = Eigen::Map<const Eigen::VectorXd>(f.data(), n),
                          f_robot = Eigen::Map<const Eigen::VectorXd>(g.data(), n);
    for (const int scales : {6, 7}) {
      const auto& expected = golden["meyer"][std::to_string(scales)]["abs_diff"];
      for (const bool exact : {true, false}) {
        int order = 0;
        const auto d = disagreement({L, f_server, golden["lmax"]}, {L, f_robot, golden["lmax"]},
                                    {.scales = scales, .tolerance_m = 1e-6, .exact = exact}, order);
        double worst = 0.0;
        for (Eigen::Index i = 0; i < n; ++i)
          for (Eigen::Index s = 0; s < scales; ++s)
            worst = std::max(
                worst,
                std::abs(d(i, s) - expected[static_cast<std::size_t>(i)][static_cast<std::size_t>(s)].get<double>()));
        EXPECT_LT(worst, exact ? 1e-9 : 1e-6) << file << ", " << scales << " scales";
      }
    }
  }
}

}  // namespace compare_test
}  // namespace tutti::consistency
