// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/range_factor.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "support/estimation/random_graphs.hpp"
#include "tutti/estimation/between_factor.hpp"

namespace tutti::estimation {
namespace range_factor_test {

using testing::random_pose;
using testing::random_tangent;

Range any_range(Rng& rng) {
  const auto point = [&] { return Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal()); };
  return {point(), point(), rng.uniform(0.0, 20.0)};
}

TEST(RangeFactor, IsZeroAtTruth) {
  Rng rng(1);
  for (int k = 0; k < 100; ++k) {
    const Pose3 T_i = random_pose(rng), T_j = random_pose(rng);
    Range range = any_range(rng);
    range.distance_m = (T_i * range.p_i - T_j * range.p_j).norm();
    EXPECT_NEAR(linearise_range(T_i, T_j, range).residual, 0.0, 1e-12);
  }
}

TEST(RangeFactor, JacobiansAreThoseOfCentralDifferences) {
  constexpr double kStep = 1e-6;
  Rng rng(2);
  for (int k = 0; k < 100; ++k) {
    const Pose3 T_i = random_pose(rng), T_j = random_pose(rng);
    const Range range = any_range(rng);
    const RangeLinearisation factor = linearise_range(T_i, T_j, range);
    for (int axis = 0; axis < 6; ++axis) {
      const Vector6d xi = kStep * Vector6d::Unit(axis);
      const auto by_i = [&](const Vector6d& move) { return linearise_range(retract(T_i, move), T_j, range).residual; };
      const auto by_j = [&](const Vector6d& move) { return linearise_range(T_i, retract(T_j, move), range).residual; };
      EXPECT_NEAR(factor.J_i(axis), (by_i(xi) - by_i(-xi)) / (2.0 * kStep), 1e-7);
      EXPECT_NEAR(factor.J_j(axis), (by_j(xi) - by_j(-xi)) / (2.0 * kStep), 1e-7);
    }
    EXPECT_LT((factor.J_i + factor.J_j * adjoint(T_j.inverse() * T_i)).norm(), 1e-9) << "common motion";
  }
}

TEST(RangeFactor, EdgeHasItsCostAndGradientAndRankOne) {
  Rng rng(3);
  for (int k = 0; k < 100; ++k) {
    const Pose3 T_i = random_pose(rng), T_j = random_pose(rng);
    const Range range = any_range(rng);
    const RangeLinearisation factor = linearise_range(T_i, T_j, range);
    const PoseGraphEdge edge = range_edge(0, 1, T_i, T_j, range, 0.2);
    const auto cost = [&](const Pose3& T) {
      const Vector6d r = between_residual(T_i, T, edge.T_from_to);
      return r.dot(edge.information * r);
    };
    EXPECT_NEAR(cost(T_j), factor.residual * factor.residual / 0.04, 1e-7 * (1.0 + cost(T_j)));
    const Vector6d xi = 1e-4 * random_tangent(rng, 1.0, 1.0);
    const double moved = linearise_range(T_i, retract(T_j, xi), range).residual;
    EXPECT_NEAR(cost(retract(T_j, xi)), moved * moved / 0.04, 1e-4 * (1.0 + cost(T_j)));
    EXPECT_EQ(Eigen::FullPivLU<Matrix6d>(edge.information).rank(), 1);
  }
}

TEST(RangeFactor, PointsThatCoincideHaveNoDirection) {
  const RangeLinearisation factor = linearise_range({}, {}, {.distance_m = 1.0});
  EXPECT_EQ(factor.residual, -1.0);
  EXPECT_TRUE(factor.J_i.isZero() && factor.J_j.isZero());
}

}  // namespace range_factor_test
}  // namespace tutti::estimation
