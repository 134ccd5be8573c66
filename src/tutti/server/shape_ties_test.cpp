// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/shape_ties.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tutti/estimation/marginals.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::server {
namespace {

constexpr std::size_t kNodes = 120;
constexpr std::size_t kMany = 4000;

/// Twice around a circle, 1 m a step; what is not said of the steps is known from closures.
struct Map {
  PoseGraph graph;
  std::vector<Matrix6d> steps;

  explicit Map(const std::vector<std::pair<std::size_t, std::size_t>>& closures) {
    const double turn = 4.0 * std::numbers::pi / static_cast<double>(kNodes);
    Vector6d variances;
    variances << Eigen::Vector3d::Constant(0.02 * 0.02), Eigen::Vector3d::Constant(0.002 * 0.002);
    const Matrix6d covariance = variances.asDiagonal();
    for (std::size_t k = 0; k < kNodes; ++k) {
      const Pose3 step{so3_exp({0.0, 0.0, turn}), {1.0, 0.0, 0.0}};
      graph.poses.push_back(k == 0 ? retract({}, Vector6d::Constant(0.3)) : graph.poses.back() * step);
      steps.push_back(k == 0 ? Matrix6d::Zero() : covariance);
      if (k > 0) add(k - 1, k, covariance);
    }
    for (const auto& [a, b] : closures) add(a, b, covariance);
  }
  void add(std::size_t a, std::size_t b, const Matrix6d& covariance) {
    graph.edges.push_back({a, b, graph.poses[a].inverse() * graph.poses[b], Matrix6d(covariance.inverse())});
  }
  [[nodiscard]] Eigen::MatrixXd samples(std::size_t count) const {
    std::vector<std::size_t> nodes(kNodes);
    std::iota(nodes.begin(), nodes.end(), std::size_t{0});
    return estimation::JointPosterior(graph, graph.poses).samples(nodes, count, Rng(1));
  }
  [[nodiscard]] std::vector<ShapeTie> ties(std::size_t samples_count, std::size_t most,
                                           const Eigen::MatrixXd& shifts = {}) const {
    return shape_ties(graph.poses, steps, samples(samples_count), shifts, most);
  }
};

TEST(ShapeTies, ThereAreNoneWithoutAClosure) { EXPECT_TRUE(Map({}).ties(kMany, 32).empty()); }

TEST(ShapeTies, NoneWhereNoneAreAskedForOrSamplesAreFew) {
  const Map map({{5, 65}});
  EXPECT_TRUE(map.ties(32, 0).empty());
  EXPECT_TRUE(map.ties(7, 32).empty());
  EXPECT_FALSE(map.ties(8, 32).empty());
}

TEST(ShapeTies, TheBestIsTheClosureItself) {
  const auto ties = Map({{5, 65}}).ties(kMany, 1);
  ASSERT_EQ(ties.size(), 1U);
  EXPECT_NEAR(ties[0].a, 5.0, 4.0);
  EXPECT_NEAR(ties[0].b, 65.0, 4.0);
}

// Sigmas against the exact covariance of the relative pose, in the worst direction.
TEST(ShapeTies, SayWhatTheJointCovarianceDoes) {
  const Map map({{5, 65}, {30, 92}});
  const auto ties = map.ties(kMany, 32);
  ASSERT_GE(ties.size(), 4U);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const ShapeTie& tie : ties) pairs.emplace_back(tie.a, tie.b);
  const auto exact = estimation::relative_covariances(map.graph, map.graph.poses, pairs);
  for (std::size_t i = 0; i < ties.size(); ++i) {
    const auto sigma = [](const Eigen::Matrix3d& C) {
      return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(C).eigenvalues()(2));
    };
    const double position = sigma(exact[i].topLeftCorner<3, 3>()), rotation = sigma(exact[i].bottomRightCorner<3, 3>());
    EXPECT_NEAR(ties[i].sigma.position_m, position, 0.08 * position) << ties[i].a << " " << ties[i].b;
    EXPECT_NEAR(ties[i].sigma.rotation_rad, rotation, 0.08 * rotation) << ties[i].a << " " << ties[i].b;
  }
}

TEST(ShapeTies, AreSortedSpreadAndAsManyAsAskedFor) {
  const Map map({{5, 65}, {20, 80}, {30, 92}, {50, 110}});
  for (const std::size_t most : {1U, 3U, 32U}) {
    const auto ties = map.ties(64, most);
    EXPECT_LE(ties.size(), most);
    EXPECT_TRUE(std::ranges::is_sorted(ties, {}, [](const ShapeTie& tie) { return std::pair(tie.a, tie.b); }));
    for (const ShapeTie& one : ties) {
      EXPECT_GE(one.b - one.a, 8U);
      for (const ShapeTie& other : ties) {
        if (one == other) continue;
        const auto apart = [](std::uint32_t x, std::uint32_t y) { return x < y ? y - x : x - y; };
        const std::uint32_t least = std::min(one.b - one.a, other.b - other.a) / 8;
        EXPECT_TRUE(apart(one.a, other.a) > least || apart(one.b, other.b) > least);
      }
    }
  }
}

// Chosen for being small by one half of the samples, said by the other: right on average.
TEST(ShapeTies, FewSamplesDoNotFlatterThemselves) {
  const Map map({{5, 65}, {20, 80}, {30, 92}, {50, 110}});
  const Eigen::MatrixXd all = map.samples(32 * 40);
  double sum = 0.0, count = 0.0;
  for (Eigen::Index draw = 0; draw < 40; ++draw) {
    const auto ties = shape_ties(map.graph.poses, map.steps, all.middleCols(32 * draw, 32), {}, 32);
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (const ShapeTie& tie : ties) pairs.emplace_back(tie.a, tie.b);
    const auto exact = estimation::relative_covariances(map.graph, map.graph.poses, pairs);
    for (std::size_t i = 0; i < ties.size(); ++i, count += 1.0)
      sum += ties[i].sigma.position_m /
             std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(exact[i].topLeftCorner<3, 3>()).eigenvalues()(2));
  }
  EXPECT_NEAR(sum / count, 1.0, 0.08);
}

// A pair that hangs on one closure is not known.
TEST(ShapeTies, WhatOneClosureMovesCounts) {
  const Map map({{5, 65}});
  const auto surely = map.ties(kMany, 1);
  ASSERT_EQ(surely.size(), 1U);
  Eigen::MatrixXd shifts = Eigen::MatrixXd::Zero(6 * kNodes, 1);
  const auto raise_m = [&](double z) {
    for (Eigen::Index k = 40; k < static_cast<Eigen::Index>(kNodes); ++k)
      shifts.col(0).segment<3>(6 * k) =
          map.graph.poses[static_cast<std::size_t>(k)].rotation.conjugate() * Eigen::Vector3d(0.0, 0.0, z);
  };
  raise_m(0.03);
  const auto less = map.ties(kMany, 1, shifts);
  ASSERT_EQ(less.size(), 1U);
  EXPECT_NEAR(less[0].sigma.position_m, std::hypot(surely[0].sigma.position_m, 0.03), 0.01);
  raise_m(3.0);
  EXPECT_TRUE(map.ties(kMany, 32, shifts).empty());
}

}  // namespace
}  // namespace tutti::server
