// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/shape_uncertainty.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <numbers>
#include <numeric>

#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/marginals.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::server {
namespace {

constexpr RobotId kRobot{3};
constexpr double kStep_m = 0.8;

/// Nodes along a line, or around once (a circle), with the same isotropic noise at every step.
PoseGraph chain(std::size_t nodes, double sigma_m, double sigma_rad, bool circle) {
  PoseGraph graph;
  const double turn = circle ? 2.0 * std::numbers::pi / static_cast<double>(nodes) : 0.0;
  for (std::size_t k = 0; k < nodes; ++k)
    graph.poses.push_back(k == 0 ? retract({}, Vector6d::Constant(0.3))
                                 : graph.poses.back() * Pose3{so3_exp({0, 0, turn}), {kStep_m, 0, 0}});
  Vector6d information;
  information << Eigen::Vector3d::Constant(1.0 / (sigma_m * sigma_m)),
      Eigen::Vector3d::Constant(1.0 / (sigma_rad * sigma_rad));
  for (std::size_t k = 1; k < nodes; ++k)
    graph.edges.push_back(
        {k - 1, k, graph.poses[k - 1].inverse() * graph.poses[k], Matrix6d(information.asDiagonal())});
  return graph;
}

void close(PoseGraph& graph, std::size_t from, std::size_t to) {
  graph.edges.push_back({from, to, graph.poses[from].inverse() * graph.poses[to], graph.edges[0].information});
}

ShapeUncertainty shape_of(const PoseGraph& graph, std::size_t samples, std::uint64_t seed = 1) {
  std::vector<std::size_t> nodes(graph.poses.size());
  std::iota(nodes.begin(), nodes.end(), std::size_t{0});
  const estimation::JointPosterior posterior(graph, graph.poses);
  return shape_uncertainty(kRobot, graph.poses, posterior.samples(nodes, samples, Rng(seed)));
}

/// The same from the dense joint covariance (node 0 fixed), with the alignment as a projection.
ShapeUncertainty exact_shape(const PoseGraph& graph) {
  const auto n = static_cast<Eigen::Index>(graph.poses.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(6 * n, 6 * n);
  for (const PoseGraphEdge& edge : graph.edges) {
    const auto factor = estimation::linearise_between(graph.poses[edge.from], graph.poses[edge.to], edge.T_from_to);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, 6 * n);
    J.middleCols<6>(static_cast<Eigen::Index>(6 * edge.from)) = factor.J_i;
    J.middleCols<6>(static_cast<Eigen::Index>(6 * edge.to)) = factor.J_j;
    H += J.transpose() * edge.information * J;
  }
  Eigen::MatrixXd C = Eigen::MatrixXd::Zero(6 * n, 6 * n);
  const Eigen::MatrixXd free = H.bottomRightCorner(6 * (n - 1), 6 * (n - 1));
  C.bottomRightCorner(6 * (n - 1), 6 * (n - 1)) = free.inverse();

  Eigen::MatrixXd to_position = Eigen::MatrixXd::Zero(3 * n, 6 * n);
  Eigen::MatrixXd to_rotation = to_position;
  Eigen::MatrixXd rigid(3 * n, 6);
  Eigen::MatrixXd turn(3 * n, 3);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Pose3& pose = graph.poses[static_cast<std::size_t>(k)];
    to_position.block<3, 3>(3 * k, 6 * k) = pose.rotation.toRotationMatrix();
    to_rotation.block<3, 3>(3 * k, 6 * k + 3) = pose.rotation.toRotationMatrix();
    rigid.middleRows<3>(3 * k) << Eigen::Matrix3d::Identity(), -skew(pose.translation);
    turn.middleRows<3>(3 * k).setIdentity();
  }
  const auto without = [](const Eigen::MatrixXd& motions, const Eigen::MatrixXd& x) {
    return Eigen::MatrixXd(x - motions * motions.completeOrthogonalDecomposition().solve(x));
  };
  const Eigen::MatrixXd A_m = without(rigid, to_position);
  const Eigen::MatrixXd A_rad = without(turn, to_rotation);
  const auto sigma = [&](const Eigen::MatrixXd& A, Eigen::Index a, Eigen::Index L) {
    const Eigen::MatrixXd rows =
        A.middleRows<3>(3 * (a + L)) - 0.5 * A.middleRows<3>(3 * a) - 0.5 * A.middleRows<3>(3 * (a + 2 * L));
    const Eigen::Matrix3d covariance = rows * C * rows.transpose();
    return std::sqrt(covariance.selfadjointView<Eigen::Lower>().eigenvalues()(2));
  };
  ShapeUncertainty out{.chain = kRobot};
  out.whole = {std::sqrt((A_m * C * A_m.transpose()).trace() / static_cast<double>(n)),
               std::sqrt((A_rad * C * A_rad.transpose()).trace() / static_cast<double>(n))};
  for (Eigen::Index L = 4; 2 * L < n; L *= 2) {
    auto& stretches = out.sag.emplace_back();
    for (Eigen::Index a = 0; a + 2 * L < n; a += 2 * L) stretches.push_back({sigma(A_m, a, L), sigma(A_rad, a, L)});
  }
  return out;
}

void expect_near(const ShapeUncertainty& shape, const ShapeUncertainty& expected, double relative) {
  const auto near = [&](const ShapeSigma& a, const ShapeSigma& b) {
    EXPECT_NEAR(a.position_m, b.position_m, relative * b.position_m);
    EXPECT_NEAR(a.rotation_rad, b.rotation_rad, relative * b.rotation_rad);
  };
  near(shape.whole, expected.whole);
  ASSERT_EQ(shape.sag.size(), expected.sag.size());
  for (std::size_t j = 0; j < shape.sag.size(); ++j) {
    ASSERT_EQ(shape.sag[j].size(), expected.sag[j].size());
    for (std::size_t i = 0; i < shape.sag[j].size(); ++i) near(shape.sag[j][i], expected.sag[j][i]);
  }
}

constexpr std::size_t kMany = 6000;
const double kManyTolerance = 4.5 / std::sqrt(2.0 * kMany);

TEST(ShapeUncertainty, IsThatOfTheDenseJointCovariance) {
  for (const bool circle : {false, true}) {
    PoseGraph graph = chain(35, 0.03, 0.01, circle);
    expect_near(shape_of(graph, kMany), exact_shape(graph), kManyTolerance);
    close(graph, 2, 30);
    close(graph, 11, 17);
    expect_near(shape_of(graph, kMany), exact_shape(graph), kManyTolerance);
  }
}

TEST(ShapeUncertainty, OfALineWithoutClosuresGrowsAsKnown) {
  // Of 2 L steps, the middle of a random walk is off by (first half - second half) / 2: L q / 2. Turns bend the line: a
  // kick i steps after the stretch's beginning moves its middle by min(i, 2 L - i) d / 2; their squares' sum.
  const double q_m = 0.02 * 0.02;
  const double q_rad = 0.004 * 0.004;
  const ShapeUncertainty shape = shape_of(chain(140, 0.02, 0.004, false), kMany);
  ASSERT_EQ(shape.sag.size(), 5U);  // L = 4 ... 64
  double L = 4.0;
  for (const auto& stretches : shape.sag) {
    ASSERT_EQ(stretches.size(), static_cast<std::size_t>(139.0 / (2.0 * L)));
    const double bend = q_rad * kStep_m * kStep_m * (2.0 * L * L * L + L) / 12.0;
    for (const ShapeSigma& sag : stretches) {
      EXPECT_NEAR(sag.position_m, std::sqrt(0.5 * L * q_m + bend), kManyTolerance * sag.position_m) << L;
      EXPECT_NEAR(sag.rotation_rad, std::sqrt(0.5 * L * q_rad), kManyTolerance * sag.rotation_rad) << L;
    }
    L *= 2.0;
  }
}

TEST(ShapeUncertainty, FewSamplesAreRightOnAverageAndByFifteenPercentEach) {
  // All directions alike: the largest of the three eigenvalues of 32 samples would be 17 % too large on average.
  const PoseGraph graph = chain(400, 0.02, 1e-6, false);
  double sum = 0.0;
  double squares = 0.0;
  std::size_t count = 0;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const ShapeUncertainty shape = shape_of(graph, 32, seed);
    for (const ShapeSigma& sag : shape.sag[0]) {
      const double error = sag.position_m / (0.02 * std::sqrt(2.0)) - 1.0;
      sum += error;
      squares += error * error;
      ++count;
    }
  }
  EXPECT_LT(std::abs(sum / static_cast<double>(count)), 0.04);
  EXPECT_LT(std::sqrt(squares / static_cast<double>(count)), 0.15);
}

TEST(ShapeUncertainty, AClosureMakesTheLargeScaleSurer) {
  PoseGraph graph = chain(129, 0.02, 0.004, true);
  const ShapeUncertainty open = shape_of(graph, 500);
  close(graph, 0, 128);
  const ShapeUncertainty closed = shape_of(graph, 500);
  EXPECT_LT(closed.sag.back()[0].position_m, 0.65 * open.sag.back()[0].position_m);
  EXPECT_LT(closed.whole.position_m, 0.7 * open.whole.position_m);
  EXPECT_NEAR(closed.sag[0][7].position_m, open.sag[0][7].position_m, 0.1 * open.sag[0][7].position_m);
}

TEST(ShapeUncertainty, IgnoresHowTheWholeMoves) {
  const PoseGraph graph = chain(30, 0.02, 0.004, true);
  const auto n = static_cast<Eigen::Index>(graph.poses.size());
  Eigen::MatrixXd samples(6 * n, 20);
  Rng rng(5);
  for (Eigen::Index s = 0; s < samples.cols(); ++s) {
    const Eigen::Vector3d turn(rng.normal(), rng.normal(), rng.normal());
    const Eigen::Vector3d move(rng.normal(), rng.normal(), rng.normal());
    for (Eigen::Index k = 0; k < n; ++k) {
      const Pose3& pose = graph.poses[static_cast<std::size_t>(k)];
      const Eigen::Quaterniond to_body = pose.rotation.conjugate();
      samples.col(s).segment<6>(6 * k) << to_body * (move + turn.cross(pose.translation)), to_body * turn;
    }
  }
  const ShapeUncertainty shape = shape_uncertainty(kRobot, graph.poses, samples);
  EXPECT_LT(shape.whole.position_m, 1e-12);
  EXPECT_LT(shape.whole.rotation_rad, 1e-12);
  for (const auto& stretches : shape.sag)
    for (const ShapeSigma& sag : stretches) EXPECT_LT(sag.position_m + sag.rotation_rad, 1e-12);
}

TEST(ShapeUncertainty, TheLargestMoveWithoutAClosureCounts) {
  const PoseGraph graph = chain(40, 0.02, 0.004, true);
  const auto n = static_cast<Eigen::Index>(graph.poses.size());
  std::vector<std::size_t> nodes(graph.poses.size());
  std::iota(nodes.begin(), nodes.end(), std::size_t{0});
  const Eigen::MatrixXd samples = estimation::JointPosterior(graph, graph.poses).samples(nodes, 100, Rng(1));
  const ShapeUncertainty surely = shape_uncertainty(kRobot, graph.poses, samples);
  // One closure pulls node 12 aside by 0.3 m, the middle of stretch 1 of 8 nodes, another one by 0.1 m; a third moves
  // the whole robot.
  Eigen::MatrixXd shifts = Eigen::MatrixXd::Zero(6 * n, 3);
  shifts(6 * 12, 0) = 0.3;
  shifts(6 * 12, 1) = 0.1;
  for (Eigen::Index k = 0; k < n; ++k)
    shifts.col(2).segment<3>(6 * k) =
        graph.poses[static_cast<std::size_t>(k)].rotation.conjugate() * Eigen::Vector3d(1.0, 2.0, 3.0);
  const ShapeUncertainty shape = shape_uncertainty(kRobot, graph.poses, samples, shifts);
  EXPECT_NEAR(shape.whole.position_m, std::hypot(surely.whole.position_m, 0.3 / std::sqrt(40.0)), 0.003);
  EXPECT_DOUBLE_EQ(shape.whole.rotation_rad, surely.whole.rotation_rad);
  for (std::size_t i = 0; i < shape.sag[0].size(); ++i) {
    // The alignment spreads a little of it over the whole.
    EXPECT_NEAR(shape.sag[0][i].position_m, std::hypot(surely.sag[0][i].position_m, i == 1 ? 0.3 : 0.0), 0.003) << i;
    EXPECT_DOUBLE_EQ(shape.sag[0][i].rotation_rad, surely.sag[0][i].rotation_rad) << i;
  }
}

TEST(ShapeUncertainty, DegenerateShapes) {
  const ShapeUncertainty one = shape_of(chain(1, 0.02, 0.004, false), 10);
  EXPECT_EQ(one.chain, ChainId(kRobot));
  EXPECT_EQ(one.whole, ShapeSigma{});
  EXPECT_TRUE(one.sag.empty());
  EXPECT_TRUE(shape_of(chain(8, 0.02, 0.004, false), 10).sag.empty());
  EXPECT_EQ(shape_of(chain(9, 0.02, 0.004, false), 10).sag.size(), 1U);

  // Two nodes: what is left of a distance; standing still: of positions no turn can be learnt.
  const ShapeUncertainty two = shape_of(chain(2, 0.02, 0.004, false), kMany);
  EXPECT_NEAR(two.whole.position_m, 0.01, 0.01 * kManyTolerance);
  PoseGraph still = chain(20, 0.02, 0.004, false);
  for (PoseGraphEdge& edge : still.edges) edge.T_from_to = {};
  for (Pose3& pose : still.poses) pose = still.poses[0];
  const ShapeUncertainty standing = shape_of(still, kMany);
  EXPECT_NEAR(standing.sag[0][0].position_m, 0.02 * std::sqrt(2.0), 0.03 * kManyTolerance);
}

}  // namespace
}  // namespace tutti::server
