// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/marginals.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "support/estimation/random_graphs.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::estimation {
namespace marginals_test {

using namespace testing;
using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

/// Joint covariance of all poses by a dense inverse; node 0 fixed.
Eigen::MatrixXd dense_covariance(const PoseGraph& graph, const std::vector<double>& weights) {
  const auto n = static_cast<Eigen::Index>(6 * graph.poses.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const auto& edge = graph.edges[e];
    const auto factor = linearise_between(graph.poses[edge.from], graph.poses[edge.to], edge.T_from_to);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, n);
    J.middleCols<6>(static_cast<Eigen::Index>(6 * edge.from)) = factor.J_i;
    J.middleCols<6>(static_cast<Eigen::Index>(6 * edge.to)) = factor.J_j;
    H += weights[e] * J.transpose() * edge.information * J;
  }
  H.topLeftCorner<6, 6>() += 1e12 * Matrix6d::Identity();  // the anchor
  return H.inverse();
}

Matrix6d relative_covariance(const PoseGraph& graph, const Eigen::MatrixXd& covariance, std::size_t a, std::size_t b) {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, covariance.rows());
  J.middleCols<6>(static_cast<Eigen::Index>(6 * a)) = -adjoint(graph.poses[b].inverse() * graph.poses[a]);
  J.middleCols<6>(static_cast<Eigen::Index>(6 * b)) = Matrix6d::Identity();
  return J * covariance * J.transpose();
}

TEST(Marginals, AreTheBlocksOfTheDenseInverse) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Rng rng(seed);
    const PoseGraph graph = random_graph(rng, 30, 5 * seed, 1.0).graph;
    std::vector<double> weights;
    for (std::size_t e = 0; e < graph.edges.size(); ++e) weights.push_back(rng.uniform(0.5, 1.0));
    const Pairs pairs{{0, 1}, {1, 0}, {4, 5}, {17, 3}, {29, 0}, {28, 29}, {7, 22}};
    const auto covariances = relative_covariances(graph, graph.poses, pairs, weights);
    const Eigen::MatrixXd joint = dense_covariance(graph, weights);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const Matrix6d expected = relative_covariance(graph, joint, pairs[k].first, pairs[k].second);
      EXPECT_LT((covariances[k] - expected).norm(), 1e-7 * expected.norm()) << seed << " " << k;
    }
  }
}

TEST(Marginals, TheJointCovarianceIsTheDenseInverse) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Rng rng(seed);
    const PoseGraph graph = random_graph(rng, 30, 5 * seed, 1.0).graph;
    std::vector<double> weights;
    for (std::size_t e = 0; e < graph.edges.size(); ++e) weights.push_back(rng.uniform(0.5, 1.0));
    const std::vector<std::size_t> nodes{17, 0, 29, 3, 4, 17};  // in any order, the anchored one, one twice
    const Eigen::MatrixXd covariance = JointPosterior(graph, graph.poses, {}, weights).covariance(nodes);
    const Eigen::MatrixXd dense = dense_covariance(graph, weights);
    ASSERT_EQ(covariance.rows(), 36);
    EXPECT_EQ(covariance, covariance.transpose().eval());
    for (std::size_t a = 0; a < nodes.size(); ++a)
      for (std::size_t b = 0; b < nodes.size(); ++b) {
        const auto of = [](std::size_t node) { return static_cast<Eigen::Index>(6 * node); };
        const Matrix6d found = covariance.block<6, 6>(of(a), of(b));
        const Matrix6d expected = dense.block<6, 6>(of(nodes[a]), of(nodes[b]));
        const double size = std::sqrt(dense.block<6, 6>(of(nodes[a]), of(nodes[a])).trace() *
                                      dense.block<6, 6>(of(nodes[b]), of(nodes[b])).trace());
        if (nodes[a] == 0 || nodes[b] == 0) {
          EXPECT_TRUE(found.isZero(0.0));
        } else {
          EXPECT_LT((found - expected).norm(), 1e-7 * size) << seed << " " << a << " " << b;
        }
      }
  }
}

TEST(Marginals, OfAChainAreItsStepsCompounded) {
  Rng rng(3);
  const auto random = random_graph(rng, 40, 0, 0.0);
  Matrix6d expected = random.covariances[10];
  for (std::size_t k = 11; k < 25; ++k)
    expected = compound_covariance(random.graph.edges[k].T_from_to, expected, random.covariances[k]);
  const auto covariances = relative_covariances(random.graph, random.truth, Pairs{{10, 25}, {12, 13}});
  EXPECT_LT((covariances[0] - expected).norm(), 1e-8 * expected.norm());
  EXPECT_LT((covariances[1] - random.covariances[12]).norm(), 1e-8 * expected.norm());
}

TEST(Marginals, DescribeTheScatterOfTheSolution) {
  // A loop closure halfway round must not raise any covariance.
  Rng rng(4);
  const auto random = random_graph(rng, 40, 0, 0.0);
  PoseGraph closed = random.graph;
  closed.edges.push_back({0, 39, random.truth[0].inverse() * random.truth[39], closed.edges[0].information});
  const Pairs pairs{{5, 6}, {0, 39}, {10, 30}};
  const auto open = relative_covariances(random.graph, random.truth, pairs);
  const auto tied = relative_covariances(closed, random.truth, pairs);
  for (std::size_t k = 0; k < pairs.size(); ++k) EXPECT_LT(tied[k].trace(), open[k].trace());
}

TEST(Marginals, SamplesHaveTheJointCovariance) {
  constexpr std::size_t kSamples = 20'000;
  Rng rng(6);
  PoseGraph graph = random_graph(rng, 12, 5, 1.0).graph;
  const std::size_t alone = graph.poses.size();  // a second component, with a gauge of its own
  graph.poses.insert(graph.poses.end(), {random_pose(rng), random_pose(rng)});
  graph.edges.push_back({alone, alone + 1, graph.poses[alone].inverse() * graph.poses[alone + 1],
                         inverse_of(random_covariance(rng, 0.1, 0.1))});
  const std::vector<double> weights(graph.edges.size(), 0.7);
  const Pairs pairs{{4, 9}};
  const JointPosterior posterior(graph, graph.poses, pairs, weights);
  std::vector<std::size_t> nodes(graph.poses.size());
  for (std::size_t k = 0; k < nodes.size(); ++k) nodes[k] = k;
  const Eigen::MatrixXd samples = posterior.samples(nodes, kSamples, Rng(7));

  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(samples.rows(), samples.rows());
  PoseGraph first = graph;
  first.poses.resize(alone);
  first.edges.pop_back();
  expected.topLeftCorner(6 * 12, 6 * 12) = dense_covariance(first, weights);
  expected.bottomRightCorner<6, 6>() = relative_covariances(graph, graph.poses, Pairs{{alone, alone + 1}}, weights)[0];
  const Eigen::MatrixXd covariance = samples * samples.transpose() / static_cast<double>(kSamples);
  for (const std::size_t anchor : {std::size_t{0}, alone})
    EXPECT_TRUE(samples.middleRows<6>(static_cast<Eigen::Index>(6 * anchor)).isZero(0.0));
  for (Eigen::Index a = 6; a < expected.rows(); ++a)
    for (Eigen::Index b = 6; b <= a; ++b)
      EXPECT_NEAR(covariance(a, b), expected(a, b),
                  5.0 / std::sqrt(kSamples) * std::sqrt(expected(a, a) * expected(b, b)) + 1e-12);
  // Both answers come from one factor.
  EXPECT_EQ(posterior.relative_covariances()[0], relative_covariances(graph, graph.poses, pairs, weights)[0]);
}

TEST(Marginals, ASampleDoesNotDependOnWhatElseIsAsked) {
  Rng rng(8);
  const PoseGraph graph = random_graph(rng, 60, 20, 1.0).graph;
  const JointPosterior posterior(graph, graph.poses);
  std::vector<std::size_t> all(graph.poses.size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = k;
  const std::vector<std::size_t> some{41, 3, 17, 0};
  const Eigen::MatrixXd of_all = posterior.samples(all, 37, Rng(9));
  const Eigen::MatrixXd of_some = posterior.samples(some, 37, Rng(9));
  for (std::size_t k = 0; k < some.size(); ++k)
    EXPECT_EQ(of_some.middleRows<6>(static_cast<Eigen::Index>(6 * k)),
              of_all.middleRows<6>(static_cast<Eigen::Index>(6 * some[k])));
}

/// One robot's odometry that knows nothing of a coordinate leaves what is known of the others as it is.
TEST(Marginals, AnUndeterminedComponentLeavesTheOthers) {
  Rng rng(6);
  PoseGraph graph = random_graph(rng, 30, 4, 0.0).graph;
  std::erase_if(graph.edges, [](const PoseGraphEdge& e) {  // nodes 0..9, 10..19 and 20..29
    return e.from / 10 != e.to / 10;
  });
  std::vector<double> weights(graph.edges.size());
  for (double& weight : weights) weight = rng.uniform(0.5, 2.0);
  const Pairs pairs{{1, 8}, {11, 14}, {21, 29}, {22, 22}, {3, 25}};
  const std::vector<std::size_t> nodes{8, 14, 29};
  const JointPosterior before(graph, graph.poses, pairs, weights);
  for (PoseGraphEdge& edge : graph.edges)
    if (edge.from / 10 == 1) edge.information.row(2).setZero(), edge.information.col(2).setZero();
  const JointPosterior after(graph, graph.poses, pairs, weights);
  const auto known = before.relative_covariances(), now = after.relative_covariances();
  for (const std::size_t k : {0U, 2U, 3U}) EXPECT_LT((known[k] - now[k]).norm(), 1e-9 * (1e-9 + known[k].norm())) << k;
  EXPECT_TRUE(std::isinf(now[1](2, 2)));
  EXPECT_TRUE(std::isinf(now[4](0, 0)));
  const Eigen::MatrixXd samples = after.samples(nodes, 5, Rng(2));
  EXPECT_TRUE(samples.topRows<6>().allFinite());
  EXPECT_TRUE(samples.middleRows<6>(6).array().isInf().all());
  EXPECT_TRUE(samples.bottomRows<6>().allFinite());
  EXPECT_GT(samples.bottomRows<6>().norm(), 0.0);
  const Eigen::MatrixXd covariance = after.covariance(nodes), whole = before.covariance(nodes);
  for (const Eigen::Index k : {0, 12}) {
    const Eigen::MatrixXd own = covariance.block<6, 6>(k, k);
    EXPECT_LT((own - whole.block<6, 6>(k, k)).norm(), 1e-9 * own.norm());
  }
  EXPECT_TRUE(covariance.diagonal().segment<6>(6).array().isInf().all());
}

// Results of few samples depend on how they are drawn: their fourth moments are those of normal numbers.
TEST(Marginals, SamplesAreNearlyNormal) {
  constexpr std::size_t kSamples = 4'000;
  Rng rng(6);
  const PoseGraph graph = random_graph(rng, 12, 5, 1.0).graph;
  const JointPosterior posterior(graph, graph.poses);
  const std::vector<std::size_t> nodes{11, 4};
  const Eigen::MatrixXd samples = posterior.samples(nodes, kSamples, Rng(7));
  const Eigen::MatrixXd covariance = posterior.covariance(nodes);
  const Eigen::MatrixXd white = covariance.llt().matrixL().solve(samples);
  const Eigen::ArrayXd distance = white.colwise().squaredNorm().transpose().array();
  // Chi-square with 12 degrees of freedom: mean 12, variance 24; and a share of 1 % beyond its 99 % quantile.
  EXPECT_NEAR(distance.mean(), 12.0, 4.0 * std::sqrt(24.0 / kSamples));
  EXPECT_NEAR((distance - distance.mean()).square().mean(), 24.0, 4.0 * std::sqrt(24.0 * 24.0 * 3.0 / kSamples));
  EXPECT_NEAR(static_cast<double>((distance > 26.217).count()) / kSamples, 0.01, 4.0 * std::sqrt(0.0099 / kSamples));
}

TEST(Marginals, SayWhatIsNotDetermined) {
  Rng rng(5);
  PoseGraph graph = random_graph(rng, 10, 0, 0.0).graph;
  graph.edges.erase(graph.edges.begin() + 4);  // nodes 0..4 and 5..9
  const auto covariances = relative_covariances(graph, graph.poses, Pairs{{4, 5}, {3, 3}, {5, 6}});
  EXPECT_TRUE(std::isinf(covariances[0](0, 0)));
  EXPECT_EQ(covariances[1], Matrix6d(Matrix6d::Zero()));
  EXPECT_TRUE(covariances[2].allFinite());
  graph.edges[0].information.setZero();
  EXPECT_TRUE(std::isinf(relative_covariances(graph, graph.poses, Pairs{{0, 1}})[0](5, 5)));
  const std::vector<std::size_t> nodes{1, 7};
  const Eigen::MatrixXd samples = JointPosterior(graph, graph.poses).samples(nodes, 3, Rng(1));
  EXPECT_EQ(samples.rows(), 12);
  EXPECT_TRUE((samples.topRows<6>().array() == std::numeric_limits<double>::infinity()).all());
  EXPECT_TRUE(samples.bottomRows<6>().allFinite());
  EXPECT_TRUE(relative_covariances({}, {}, {}).empty());
  EXPECT_EQ(JointPosterior({}, {}).samples({}, 3, Rng(1)).rows(), 0);
}

}  // namespace marginals_test
}  // namespace tutti::estimation
