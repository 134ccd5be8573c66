// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/graph.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/spectral/graphs.hpp"

namespace tutti::spectral {
namespace graph_test {

using Eigen::MatrixXd;
using Eigen::Vector3d;

std::vector<Vector3d> random_positions(int nodes, double size_m, Rng& rng) {
  std::vector<Vector3d> out;
  for (int n = 0; n < nodes; ++n)
    out.emplace_back(rng.uniform(-size_m, size_m), rng.uniform(-size_m, size_m), rng.uniform(-size_m, size_m));
  return out;
}

/// Every pair, straight from eq. (1).
MatrixXd dense_adjacency(const std::vector<Vector3d>& positions, double radius_m, double sigma_m) {
  const auto nodes = static_cast<Eigen::Index>(positions.size());
  MatrixXd out = MatrixXd::Zero(nodes, nodes);
  for (std::size_t a = 0; a < positions.size(); ++a) {
    for (std::size_t b = 0; b < positions.size(); ++b) {
      const double distance = (positions[a] - positions[b]).norm();
      if (a != b && distance <= radius_m)
        out(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) = std::exp(-distance / (2 * sigma_m * sigma_m));
    }
  }
  return out;
}

RC_GTEST_PROP(ProximityAdjacency, EqualsEveryPairTested, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(0, 60);
  const double radius_m = rng.uniform(0.5, 9.0);
  const double sigma_m = rng.uniform(0.4, 3.0);
  const auto positions = random_positions(nodes, 10.0, rng);
  const SparseMatrix adjacency = proximity_adjacency(positions, radius_m, sigma_m);
  RC_ASSERT(MatrixXd(adjacency) == dense_adjacency(positions, radius_m, sigma_m));
  for (int n = 0; n < nodes; ++n) {  // ascending inside columns, as promised
    for (int k = adjacency.outerIndexPtr()[n] + 1; k < adjacency.outerIndexPtr()[n + 1]; ++k)
      RC_ASSERT(adjacency.innerIndexPtr()[k - 1] < adjacency.innerIndexPtr()[k]);
  }
}

TEST(ProximityAdjacency, RadiusBelongsToIt) {
  const std::vector<Vector3d> positions{{0, 0, 0}, {7, 0, 0}, {0, -7.000001, 0}, {14, 0, 0}};
  const SparseMatrix adjacency = proximity_adjacency(positions, 7.0, 1.0);
  EXPECT_EQ(adjacency.nonZeros(), 4);
  EXPECT_DOUBLE_EQ(adjacency.coeff(0, 1), std::exp(-3.5));
  EXPECT_DOUBLE_EQ(adjacency.coeff(3, 1), std::exp(-3.5));
}

/// The nearest nodes of each, within the radius, nearer ones first, the smaller number of two as near.
std::vector<std::vector<int>> nearest_nodes(const std::vector<Vector3d>& positions, double radius_m) {
  std::vector<std::vector<int>> out(positions.size());
  for (std::size_t n = 0; n < positions.size(); ++n) {
    const auto distance = [&](int m) { return (positions[n] - positions[static_cast<std::size_t>(m)]).norm(); };
    for (int m = 0; m < static_cast<int>(positions.size()); ++m)
      if (m != static_cast<int>(n) && distance(m) <= radius_m) out[n].push_back(m);
    std::ranges::stable_sort(out[n], {}, distance);
  }
  return out;
}

RC_GTEST_PROP(ProximityAdjacency, JoinsWhatIsAmongTheNearestOfEither, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(0, 60), most = *rc::gen::inRange(1, 12);
  auto positions = random_positions(nodes, 6.0, rng);
  if (*rc::gen::arbitrary<bool>())  // on a grid many are as near as each other, or at one place
    for (Vector3d& position : positions) position = position.array().round();
  const SparseMatrix full = proximity_adjacency(positions, 7.0, 1.0);
  const SparseMatrix some = proximity_adjacency(positions, 7.0, 1.0, most);
  const auto nearest = nearest_nodes(positions, 7.0);
  const auto is_near = [&](int n, int m) {
    const auto& list = nearest[static_cast<std::size_t>(n)];
    return std::find(list.begin(), list.end(), m) - list.begin() < std::min<std::ptrdiff_t>(most, std::ssize(list));
  };
  for (int n = 0; n < nodes; ++n)
    for (int m = 0; m < nodes; ++m)
      RC_ASSERT(some.coeff(n, m) == (is_near(n, m) || is_near(m, n) ? full.coeff(n, m) : 0.0));
  RC_ASSERT(MatrixXd(some) == MatrixXd(some).transpose());
  RC_ASSERT(MatrixXd(proximity_adjacency(positions, 7.0, 1.0, nodes)) == MatrixXd(full));  // fewer than so many
}

TEST(ProximityAdjacency, ARoomFullOfNodesHasFewEdges) {
  Rng rng(2);
  const auto positions = random_positions(1000, 1.5, rng);
  const SparseMatrix adjacency = proximity_adjacency(positions, 7.0, 1.0, 32);
  EXPECT_EQ(connected_components(adjacency).count, 1);
  EXPECT_GE(adjacency.nonZeros(), 32 * 1000);
  EXPECT_LE(adjacency.nonZeros(), 2 * 32 * 1000);
}

TEST(ProximityAdjacency, DivergedAndCoincidentNodes) {
  const std::vector<Vector3d> positions{{0, 0, 0}, {1e300, 0, 0}, {0, 0, 0}, {1e17, 1e17, 0}, {1e17, 1e17, 0}};
  const SparseMatrix adjacency = proximity_adjacency(positions, 7.0, 1.0);
  EXPECT_EQ(adjacency.coeff(0, 2), 1.0);
  EXPECT_EQ(adjacency.coeff(3, 4), 1.0);
  EXPECT_EQ(adjacency.nonZeros(), 4);
  EXPECT_EQ(connected_components(adjacency).count, 3);
}

TEST(ProximityAdjacency, RefusesWhatIsNotAPosition) {
  const std::vector<Vector3d> positions{{0, 0, 0}, {0, std::nan(""), 0}};
  EXPECT_THROW((void)proximity_adjacency(positions, 7.0, 1.0), std::logic_error);
  EXPECT_THROW((void)proximity_adjacency({}, 0.0, 1.0), std::logic_error);
}

TEST(AdjacencyFromEdges, ParallelEdgesAddUpInAnyOrder) {
  const std::vector<WeightedEdge> one{{0, 2, 0.1}, {2, 0, 0.2}, {0, 2, 0.3}};
  const std::vector<WeightedEdge> other{{2, 0, 0.3}, {0, 2, 0.1}, {2, 0, 0.2}};
  EXPECT_EQ(MatrixXd(adjacency_from_edges(3, one)), MatrixXd(adjacency_from_edges(3, other)));
  EXPECT_NEAR(adjacency_from_edges(3, one).coeff(2, 0), 0.6, 1e-15);
  const std::vector<WeightedEdge> loop{{1, 1, 1.0}};
  EXPECT_THROW((void)adjacency_from_edges(3, loop), std::logic_error);
}

RC_GTEST_PROP(Laplacian, RowSumsAreZeroAndItIsPositiveSemidefinite, (std::uint64_t seed)) {
  Rng rng(seed);
  const int nodes = *rc::gen::inRange(1, 40);
  const MatrixXd L = testing::laplacian_of(nodes, testing::random_edges(nodes, 2, rng));
  RC_ASSERT(L == L.transpose());
  RC_ASSERT(L.rowwise().sum().cwiseAbs().maxCoeff() <= 1e-14 * (1.0 + L.diagonal().maxCoeff()));
  const Eigen::VectorXd f = Eigen::VectorXd::NullaryExpr(nodes, [&] { return rng.normal(); });
  double energy = 0.0;  // f^T L f = sum over edges w (f_a - f_b)^2
  for (int a = 0; a < nodes; ++a)
    for (int b = 0; b < a; ++b) energy -= L(a, b) * (f[a] - f[b]) * (f[a] - f[b]);
  RC_ASSERT(std::abs(f.dot(L * f) - energy) <= 1e-12 * (1.0 + energy));
}

TEST(Laplacian, SmallestGraphs) {
  EXPECT_EQ(laplacian(proximity_adjacency({}, 7.0, 1.0)).rows(), 0);
  const std::vector<Vector3d> one{{1, 2, 3}};
  const SparseMatrix L = laplacian(proximity_adjacency(one, 7.0, 1.0));
  EXPECT_EQ(L.nonZeros(), 1);  // the isolated node's 0 is stored
  EXPECT_EQ(L.coeff(0, 0), 0.0);
}

TEST(ConnectedComponents, NumberedByTheirFirstNode) {
  const auto components = connected_components(testing::laplacian_of(6, {{4, 0, 1.0}, {2, 5, 1.0}, {5, 3, 1.0}}));
  EXPECT_EQ(components.count, 3);
  EXPECT_EQ(components.label, (std::vector<int>{0, 1, 2, 2, 0, 2}));
  EXPECT_EQ(connected_components(SparseMatrix(0, 0)).count, 0);
}

}  // namespace graph_test
}  // namespace tutti::spectral
