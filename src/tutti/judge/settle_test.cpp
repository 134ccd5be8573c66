// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/settle.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::judge {
namespace settle_test {

Matrix6d information(double sigma_m, double sigma_rad) {
  Vector6d v;
  v << Eigen::Vector3d::Constant(1.0 / (sigma_m * sigma_m)), Eigen::Vector3d::Constant(1.0 / (sigma_rad * sigma_rad));
  return v.asDiagonal();
}

/// Two laps round a circle of 200 m; `strength`: odometry's true errors over what it states.
struct Circle {
  static constexpr std::size_t kLap = 100;
  Rng rng{11};
  std::vector<Pose3> truth{Pose3{}};
  PoseGraph graph{.poses = {Pose3{}}, .edges = {}};
  std::size_t odometry_edges = 2 * kLap;

  explicit Circle(double strength = 1.0) {
    const Pose3 step{so3_exp({0.0, 0.0, 2.0 * M_PI / kLap}), {2.0, 0.0, 0.0}};
    for (std::size_t k = 0; k < odometry_edges; ++k) {
      truth.push_back(truth.back() * step);
      const Pose3 measured = retract(step, noise(0.02 * strength, 0.002 * strength));
      graph.poses.push_back(graph.poses.back() * measured);
      graph.edges.push_back({k, k + 1, measured, information(0.02, 0.002)});
    }
  }
  Vector6d noise(double sigma_m, double sigma_rad) {
    Vector6d out;
    for (int i = 0; i < 6; ++i) out(i) = rng.normal(i < 3 ? sigma_m : sigma_rad);
    return out;
  }
  void close(std::size_t from, const Pose3& wrong_by = {}) {
    const Pose3 T = retract(truth[from].inverse() * truth[from + kLap] * wrong_by, noise(0.03, 0.003));
    graph.edges.push_back({from, from + kLap, T, information(0.03, 0.003)});
  }
  [[nodiscard]] Settled settled(std::vector<char> in, std::vector<bool> certain = {}) const {
    certain.resize(in.size(), false);
    return settle_closures(graph, odometry_edges, std::move(in), certain, {}, {});
  }
};

TEST(Settle, RightClosuresThatWereRefusedComeBack) {
  Circle circle;
  for (std::size_t k = 2; k < Circle::kLap; k += 7) circle.close(k);
  std::vector<char> in(circle.graph.edges.size() - circle.odometry_edges, 0);
  in[3] = 1;  // the map begins with one
  const Settled settled = circle.settled(in);
  EXPECT_EQ(settled.in, std::vector<char>(in.size(), 1));
  for (const Price& price : settled.prices) EXPECT_LT(price.paid, price.most);
}

TEST(Settle, TheLoopThatAloneMeasuresHowFarOdometryIsOffCountsByTheMapsDoubt) {
  Circle circle(2.0);  // a published drive's optimum asks this much more of odometry than it states
  circle.close(50);
  const Settled settled = circle.settled({0});
  EXPECT_EQ(settled.in.front(), 1);
  const Vector6d missed = local(circle.graph.edges.back().T_from_to,
                                circle.graph.poses[50].inverse() * circle.graph.poses[50 + Circle::kLap]);
  EXPECT_GT(missed.dot(circle.graph.edges.back().information * missed), 100.0);  // by its own covariance alone
}

TEST(Settle, WrongClosuresThatAreInGo) {
  Circle circle;
  for (std::size_t k = 2; k < Circle::kLap; k += 7) circle.close(k);
  circle.close(33, Pose3{{}, {6.0, 0.0, 0.0}});
  circle.close(77, Pose3{so3_exp({0.0, 0.0, 0.5}), Eigen::Vector3d::Zero()});
  std::vector<char> in(circle.graph.edges.size() - circle.odometry_edges, 1);
  const Settled settled = circle.settled(in);
  std::vector<char> right = in;
  right.back() = right[right.size() - 2] = 0;
  EXPECT_EQ(settled.in, right);
  EXPECT_GT(settled.prices.back().paid, settled.prices.back().most);
}

TEST(Settle, WhatIsCertainStaysWhateverItCosts) {
  Circle circle;
  for (std::size_t k = 2; k < Circle::kLap; k += 7) circle.close(k);
  circle.close(33, Pose3{{}, {6.0, 0.0, 0.0}});
  const std::size_t closures = circle.graph.edges.size() - circle.odometry_edges;
  std::vector<bool> certain(closures, false);
  certain.back() = true;
  EXPECT_EQ(circle.settled(std::vector<char>(closures, 1), certain).in.back(), 1);
}

TEST(Settle, AGraphThatCannotBeSolvedIsReportedToBeSo) {
  Circle circle;
  circle.close(50);
  circle.graph.edges.front().information.setConstant(std::nan(""));
  const Settled settled = circle.settled({1});
  EXPECT_FALSE(estimation::is_usable(settled.termination));
  EXPECT_EQ(settled.poses.size(), circle.graph.poses.size());
  EXPECT_EQ(settled.prices.size(), 1U);
}

TEST(Settle, CostsASolutionAndAFactorisationARound) {
  Circle circle;
  for (std::size_t k = 2; k < Circle::kLap; k += 3) circle.close(k);
  const Settled settled = circle.settled(std::vector<char>(circle.graph.edges.size() - circle.odometry_edges, 1));
  EXPECT_LE(settled.factorisations, 12U);
}

}  // namespace settle_test
}  // namespace tutti::judge
