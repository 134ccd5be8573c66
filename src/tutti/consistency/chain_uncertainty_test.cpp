// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/chain_uncertainty.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <string>
#include <vector>

#include "support/consistency/uncertainty.hpp"
#include "tutti/consistency/disagreement.hpp"
#include "tutti/consistency/internal/chain_filter.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/spectral/spectrum.hpp"
#include "tutti/spectral/wavelet_transform.hpp"

namespace tutti::consistency {
namespace chain_uncertainty_test {

using Eigen::Index;
using Eigen::MatrixXd;
using test::kBravo;

constexpr std::size_t kNodes = 120;

/// One robot's nodes in a graph, another's before them.
struct Scene {
  ProxyGraph graph;
  std::vector<Pose3> server;
  std::vector<NodePair> pairs;

  explicit Scene(std::vector<Pose3> poses) : server(std::move(poses)) {
    auto all = test::server_nodes(kBravo, server);
    const auto others = test::server_nodes(test::kAlpha, test::corridor(7));
    all.insert(all.end(), others.begin(), others.end());
    graph = build_proxy_graph(1, all, {}, {});
    for (std::size_t n = 0; n < server.size(); ++n) pairs.push_back({others.size() + n, n});
  }
};

std::vector<Pose3> corridor_with_gap(std::size_t nodes) {
  std::vector<Pose3> out = test::corridor(nodes);
  for (std::size_t n = nodes / 3; n < nodes; ++n) out[n].translation.z() += 50.0;
  return out;
}

test::WalkWithClosures usual_map(std::size_t nodes = kNodes) { return {nodes, 30, {0.01, 5e-4}, {0.02, 2e-3}}; }

/// The true coefficients of one kind of error: per node and scale the covariance of the three axes, from the covariance
/// of the nodes (the same along every axis) through the exact filter.
class TrueCoefficients {
 public:
  TrueCoefficients(const Scene& scene, const MatrixXd& covariance, bool positions)
      : spectrum_(spectral::dense_spectrum(internal::chain_laplacian(scene.graph, kBravo))),
        bank_(internal::kScales,
              spectral::WaveletFilter(internal::chain_laplacian(scene.graph, kBravo), internal::kScales)
                  .bank()
                  .lambda_max()),
        gauge_(gauge_of(scene, positions)) {
    const MatrixXd root = covariance.llt().matrixL();
    const Index n = root.rows();
    MatrixXd errors = MatrixXd::Zero(n, 9 * n);  // n x 3 for every unit draw along every axis
    for (Index j = 0; j < n; ++j)
      for (Index axis = 0; axis < 3; ++axis) errors.col(9 * j + 4 * axis) = root.col(j);
    W_ = transformed(errors);
  }
  [[nodiscard]] Index nodes() const { return W_.rows(); }
  [[nodiscard]] Eigen::Matrix3d covariance(Index node, int scale) const {
    const MatrixXd row = W_.row(node).segment(scale * 9 * nodes(), 9 * nodes());
    const MatrixXd draws = row.reshaped(3, 3 * nodes());
    return draws * draws.transpose();
  }
  [[nodiscard]] double variance_of_worst(Index node, int scale) const {
    return eigen_of(covariance(node, scale)).values(2);
  }
  /// The coefficients of errors, n x (3 columns), as spectral::exact_transform gives them.
  [[nodiscard]] MatrixXd transformed(MatrixXd errors) const {
    for (Index c = 0; c < errors.cols(); c += 3) {
      Eigen::VectorXd x = errors.middleCols<3>(c).transpose().reshaped();
      x -= gauge_ * (gauge_.transpose() * x);
      errors.middleCols<3>(c) = x.reshaped(3, errors.rows()).transpose();
    }
    return spectral::exact_transform(spectrum_, bank_, errors);
  }

 private:
  /// Orthonormal: what an alignment takes out of the errors of the nodes, 3 rows each.
  static MatrixXd gauge_of(const Scene& scene, bool positions) {
    const auto n = static_cast<Index>(scene.server.size());
    MatrixXd moves(3 * n, positions ? 6 : 3);
    for (Index k = 0; k < n; ++k) {
      moves.block<3, 3>(3 * k, 0).setIdentity();
      if (positions) moves.block<3, 3>(3 * k, 3) = -skew(scene.server[static_cast<std::size_t>(k)].translation);
    }
    return Eigen::HouseholderQR<MatrixXd>(moves).householderQ() * MatrixXd::Identity(3 * n, moves.cols());
  }
  spectral::Spectrum spectrum_;
  spectral::MeyerFilterBank bank_;
  MatrixXd gauge_, W_;
};

/// Stated over true sigma of every block and scale.
void add_ratios(const ChainUncertainty& stated, const TrueCoefficients& truth, bool positions,
                std::vector<double>& out) {
  for (std::size_t s = 0; s < stated.scales.size(); ++s) {
    const ScaleUncertainty& scale = stated.scales[s];
    if (scale.sigma.empty()) continue;
    std::vector<double> variance(scale.sigma.size(), 0.0);
    for (Index n = 0; n < truth.nodes(); ++n) {
      const std::size_t block = static_cast<std::size_t>(n) / ChainUncertainty::kBlock;
      variance[block] = std::max(variance[block], truth.variance_of_worst(n, static_cast<int>(s)));
    }
    for (std::size_t b = 0; b < variance.size(); ++b)
      out.push_back((positions ? scale.sigma[b].position_m : scale.sigma[b].rotation_rad) / std::sqrt(variance[b]));
  }
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

TEST(ChainUncertainty, SigmasAreThoseOfTheTrueCovariance) {
  const struct {
    std::string name;
    test::WalkWithClosures map;
    std::vector<Pose3> poses;
  } kinds[] = {{"usual", usual_map(), test::corridor(kNodes)},
               {"closed at the ends", {kNodes, kNodes - 1, {0.05, 2e-3}, {0.02, 2e-3}}, test::corridor(kNodes)},
               {"in two pieces", {kNodes, 40, {0.1, 2e-3}, {0.02, 2e-3}}, corridor_with_gap(kNodes)}};
  for (const auto& [name, map, poses] : kinds) {
    const Scene scene(poses);
    const ChainUncertainty stated = map.uncertainty(scene.graph, kBravo);
    ASSERT_EQ(stated.scales.size(), 4U);
    std::vector<double> ratios;
    add_ratios(stated, {scene, map.position_covariance(), true}, true, ratios);
    add_ratios(stated, {scene, map.rotation_covariance(), false}, false, ratios);
    const auto [least, most] = std::ranges::minmax(ratios);
    std::printf("[ MEASURED ] %s: stated over true sigma %.2f .. %.2f, %.2f in the mean\n", name.c_str(), least, most,
                mean(ratios));
    EXPECT_GT(least, 0.75) << name;  // 64 samples
    EXPECT_LT(most, 1.3) << name;    // the largest of ten nodes
    EXPECT_NEAR(mean(ratios), 1.0, 0.25) << name;
  }
}

/// The combination that a direction speaks of, of what `robot` is off by: its first node is laid on the server's.
double combination(const KnownDirection& direction, const std::vector<Pose3>& server, const std::vector<Pose3>& robot) {
  const auto spread = ChainUncertainty::spread(server.size());
  const Pose3 T = server.front() * robot.front().inverse();
  double out = 0.0;
  for (std::size_t k = 1; k < spread.size(); ++k) {
    const Pose3 here = T * robot[spread[k]];
    const Eigen::Vector3d dp = here.translation - server[spread[k]].translation;
    const Eigen::Vector3d dr = so3_log(here.rotation * server[spread[k]].rotation.conjugate());
    for (std::size_t axis = 0; axis < 3; ++axis)
      out += direction.position[3 * (k - 1) + axis] / 127.0 * dp(static_cast<Index>(axis)) +
             direction.rotation_scale * direction.rotation[3 * (k - 1) + axis] / 127.0 * dr(static_cast<Index>(axis));
  }
  return out;
}

/// The variance that rounding of poses adds along a direction.
double rounding_variance(const KnownDirection& direction) {
  double out = 0.0;
  for (std::size_t i = 0; i < direction.position.size(); ++i)
    out += std::pow(direction.position[i] / 127.0 * internal::kRounding.position_m, 2) +
           std::pow(direction.rotation_scale * direction.rotation[i] / 127.0 * internal::kRounding.rotation_rad, 2);
  return out;
}

// By drawing: the map's errors along a direction are as large as its sigma says, odometry's at least twice as large.
TEST(ChainUncertainty, DirectionsAreWhatClosuresKnowFarBetterThanOdometry) {
  constexpr int kDraws = 1500;
  const PoseSigma step{1e-3, 2e-4};
  const test::WalkWithClosures map(kNodes, kNodes - 1, step, {5e-4, 1e-4});
  const Scene scene(test::corridor(kNodes));
  const ChainUncertainty stated = map.uncertainty(scene.graph, kBravo);
  ASSERT_FALSE(stated.directions.empty());
  EXPECT_LE(stated.directions.size(), 4U);
  std::vector<double> of_map(stated.directions.size(), 0.0), of_odometry = of_map;
  std::vector<Pose3> steps;
  for (std::size_t n = 1; n < kNodes; ++n) steps.push_back(scene.server[n - 1].inverse() * scene.server[n]);
  for (int draw = 0; draw < kDraws; ++draw) {
    const auto drawn = map.displace(scene.server, Rng(8).fork(static_cast<std::uint64_t>(draw)));
    Rng rng = Rng(9).fork(static_cast<std::uint64_t>(draw));
    // Between spread nodes the errors of odometry are those of the straight trajectory, which chain_uncertainty() gets.
    std::vector<Pose3> odometry{scene.server.front()};
    const auto spread = ChainUncertainty::spread(kNodes);
    for (std::size_t k = 1; k < spread.size(); ++k) {
      const double root = std::sqrt(static_cast<double>(spread[k] - spread[k - 1]));
      Pose3 motion = scene.server[spread[k - 1]].inverse() * scene.server[spread[k]];
      Vector6d error;
      for (Index i = 0; i < 6; ++i) error(i) = rng.normal(root * (i < 3 ? step.position_m : step.rotation_rad));
      motion = retract(motion, error);
      for (std::size_t n = spread[k - 1] + 1; n < spread[k]; ++n) odometry.push_back(odometry.back());
      odometry.push_back(odometry[spread[k - 1]] * motion);
    }
    for (std::size_t d = 0; d < stated.directions.size(); ++d) {
      of_map[d] += std::pow(combination(stated.directions[d], scene.server, drawn), 2) / kDraws;
      of_odometry[d] += std::pow(combination(stated.directions[d], scene.server, odometry), 2) / kDraws;
    }
  }
  const double slack = 4.0 * std::sqrt(2.0 / kDraws);
  for (std::size_t d = 0; d < stated.directions.size(); ++d) {
    const KnownDirection& direction = stated.directions[d];
    const double expected = direction.sigma * direction.sigma - rounding_variance(direction);
    EXPECT_NEAR(of_map[d] / expected, 1.0, slack) << d;
    EXPECT_LT(of_map[d], 0.25 * (1.0 + 2.0 * slack) * of_odometry[d]) << d;
    int largest = 0;
    for (const std::int8_t number : direction.position) largest = std::max(largest, std::abs(int{number}));
    EXPECT_EQ(largest, 127);
  }
}

// One closure, a third along the trajectory, turned by 0.1 rad, 200 times what odometry may turn a step, or by 0.003
// rad, which it may well have missed; the robot is to follow the map without the former, every node of it.
TEST(ChainUncertainty, WhatOneClosureMeasuresAgainstOdometryIsDoubted) {
  const Scene scene(test::corridor(kNodes));
  ChainKnowledge known = usual_map().knowledge(scene.graph, kBravo);
  const auto turned_by = [&](double angle_rad) {  // evenly, from node 40 to 80
    known.shifts = MatrixXd::Zero(6 * kNodes, 2);
    known.shift_places = {1, 1};
    std::vector<Eigen::Vector3d> moved;
    for (std::size_t n = 0; n < kNodes; ++n) {
      Vector6d shift = Vector6d::Zero();
      for (std::size_t i = 40; i < std::min<std::size_t>(n, 80); ++i) {
        const Eigen::Vector3d turn(0.0, 0.0, angle_rad / 40.0);
        shift.head<3>() += turn.cross(scene.server[n].translation - scene.server[i].translation);
        shift.tail<3>() += turn;
      }
      moved.emplace_back(shift.head<3>());
      const Eigen::Matrix3d to_body = scene.server[n].rotation.conjugate().toRotationMatrix();
      known.shifts.col(1).segment<6>(6 * static_cast<Index>(n)) << to_body * shift.head<3>(), to_body * shift.tail<3>();
    }
    return moved;
  };
  const auto moved = turned_by(0.1);
  ProxyGraph graph = scene.graph;
  graph.uncertainties = {chain_uncertainty(graph, kBravo, known)};
  ASSERT_TRUE(graph.uncertainties[0].doubted.has_value());
  const ProxyGraph followed = without_doubted(graph, kBravo);
  double largest_m = 0.0;
  for (const auto& by : moved) largest_m = std::max(largest_m, by.norm());
  ASSERT_GT(largest_m, 1.0);
  for (std::size_t n = 0; n < kNodes; ++n)
    EXPECT_LT((nodes_of(followed, kBravo)[n].T_world_body.translation - scene.server[n].translation - moved[n]).norm(),
              0.02 * largest_m)
        << n;
  EXPECT_EQ(followed.nodes[0], graph.nodes[0]);  // another robot's
  (void)turned_by(0.003);
  const auto little = chain_uncertainty(graph, kBravo, known).doubted;
  EXPECT_LT(little ? little->sigma : 0.0, 0.03 * 0.03 * largest_m);
  // Odometry without information contradicts no closure.
  (void)turned_by(0.1);
  for (Matrix6d& step : known.spread_odometry) step *= 1e6;
  const auto open = chain_uncertainty(graph, kBravo, known).doubted;
  EXPECT_LT(open ? open->sigma : 0.0, 0.03 * largest_m);
}

// A map that is odometry and nothing else: nothing is known better.
TEST(ChainUncertainty, WithoutClosuresThereAreNoDirections) {
  const Scene scene(test::corridor(kNodes));
  ChainKnowledge known = usual_map().knowledge(scene.graph, kBravo);
  const auto spread = ChainUncertainty::spread(kNodes);
  const auto m = static_cast<Index>(spread.size());
  known.spread_covariance.setZero(6 * m, 6 * m);  // of tangents: every step moves all nodes after it
  for (Index step = 1; step < m; ++step)
    for (Index a = step; a < m; ++a)
      for (Index b = step; b < m; ++b) {
        const auto to = [&](Index k) {
          return adjoint(scene.server[spread[static_cast<std::size_t>(k)]].inverse() *
                         scene.server[spread[static_cast<std::size_t>(step)]]);
        };
        known.spread_covariance.block<6, 6>(6 * a, 6 * b) +=
            to(a) * known.spread_odometry[static_cast<std::size_t>(step)] * to(b).transpose();
      }
  EXPECT_TRUE(chain_uncertainty(scene.graph, kBravo, known).directions.empty());
  known.spread_covariance *= 0.26;
  EXPECT_TRUE(chain_uncertainty(scene.graph, kBravo, known).directions.empty());
  known.spread_covariance *= 0.9;  // all of them: the four smallest
  EXPECT_EQ(chain_uncertainty(scene.graph, kBravo, known).directions.size(), 4U);
}

TEST(ChainUncertainty, OfOneNodeAndOfTwo) {
  for (const std::size_t count : {1U, 2U, 3U}) {
    const test::WalkWithClosures map(count, 1, {0.01, 5e-4}, {0.01, 1e-3});
    const Scene scene(test::corridor(count));
    const ChainUncertainty stated = map.uncertainty(scene.graph, kBravo);
    EXPECT_EQ(stated.scales.size(), count < 2 ? 0U : 4U);
    if (count == 2) {  // one wave is too few
      for (const ScaleUncertainty& scale : stated.scales) EXPECT_TRUE(scale.sigma.empty());
    }
    for (const KnownDirection& direction : stated.directions) {
      EXPECT_EQ(direction.position.size(), 3 * (count - 1));
      EXPECT_EQ(direction.rotation.size(), 3 * (count - 1));
      EXPECT_TRUE(std::isfinite(direction.sigma) && direction.sigma > 0.0);
      EXPECT_TRUE(std::isfinite(direction.rotation_scale) && direction.rotation_scale > 0.0);
    }
    if (count == 1) {
      EXPECT_NEAR(stated.whole.position_m, 0.0, 1e-12);
      EXPECT_TRUE(stated.directions.empty());
    } else {
      EXPECT_GT(stated.whole.rotation_rad, 1e-4);
    }
  }
}

TEST(ChainUncertainty, FewSamplesGiveNoScales) {
  const Scene scene(test::corridor(30));
  ChainKnowledge known = usual_map(30).knowledge(scene.graph, kBravo);
  known.samples.conservativeResize(Eigen::NoChange, kLeastSamples - 1);
  const ChainUncertainty stated = chain_uncertainty(scene.graph, kBravo, known);
  EXPECT_TRUE(stated.scales.empty());
  EXPECT_GT(stated.whole.position_m, 0.0);
}

}  // namespace chain_uncertainty_test
}  // namespace tutti::consistency
