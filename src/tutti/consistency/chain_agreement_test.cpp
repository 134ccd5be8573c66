// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/chain_agreement.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <numeric>

#include "support/sanitized.hpp"
#include "tutti/consistency/testing/uncertainty.hpp"

namespace tutti::consistency {
namespace {

using test::kAlpha;
using test::WalkWithClosures;

std::vector<std::size_t> all_of(std::size_t nodes) {
  std::vector<std::size_t> ranks(nodes);
  std::iota(ranks.begin(), ranks.end(), 0U);
  return ranks;
}

AgreementConfig with_signal(const std::string& signal) {
  AgreementConfig config;
  config.signal = signal;
  return config;
}

/// A map of 5 mm and 0.3 mrad a step, closed to 1 cm and 1 mrad at every 25th node.
WalkWithClosures usual_map(std::size_t nodes) { return {nodes, 25, {0.005, 3e-4}, {0.01, 1e-3}}; }

TEST(Quantile, ChiWithThreeDegreesAgreesWithTables) {
  // Roots of the tabulated chi-square quantiles (Abramowitz and Stegun, table 26.8).
  EXPECT_NEAR(chi_3_exceeded_with(0.5), std::sqrt(2.36597), 1e-5);
  EXPECT_NEAR(chi_3_exceeded_with(0.1), std::sqrt(6.25139), 1e-5);
  EXPECT_NEAR(chi_3_exceeded_with(0.05), std::sqrt(7.81473), 1e-5);
  EXPECT_NEAR(chi_3_exceeded_with(0.01), std::sqrt(11.3449), 1e-5);
  EXPECT_NEAR(chi_3_exceeded_with(0.001), std::sqrt(16.2662), 1e-5);
}

TEST(Quantile, ChiSquareAgreesWithTablesWithinThreePercent) {
  struct Row {
    double probability, degrees, value;
  };
  for (const Row& row : {Row{0.05, 3, 7.81473},
                         {0.01, 3, 11.3449},
                         {0.001, 3, 16.2662},
                         {0.05, 10, 18.3070},
                         {0.01, 10, 23.2093},
                         {0.001, 10, 29.5883},
                         {0.05, 100, 124.342},
                         {0.01, 100, 135.807},
                         {0.001, 100, 149.449},
                         {0.95, 10, 3.94030}})
    EXPECT_NEAR(chi_square_exceeded_with(row.probability, row.degrees) / row.value, 1.0, 0.03)
        << row.probability << " " << row.degrees;
}

// The exact one of the two says how far the other is off.
RC_GTEST_PROP(Quantile, TheTwoAgreeDownToTinyProbabilities, ()) {
  const double p = std::pow(10.0, -*rc::gen::inRange(1, 10)) * *rc::gen::inRange(1, 9);
  RC_PRE(p < 0.9);
  const double chi = chi_3_exceeded_with(p), ratio = chi_square_exceeded_with(p, 3.0) / (chi * chi);
  RC_ASSERT(std::abs(ratio - 1.0) < (p < 1e-3 ? 0.14 : 0.02));
  RC_ASSERT(p > 0.01 || ratio > 1.0);  // errs on the side of fewer alarms
  RC_ASSERT(chi_3_exceeded_with(0.5 * p) > chi);
}

/// The share of runs that are told they disagree although they differ only as the server says they may.
class Calibration : public testing::TestWithParam<const char*> {
 protected:
  static constexpr std::size_t kNodes = 200;
  static double false_alarms(const WalkWithClosures& map, const AgreementConfig& config, double stated = 1.0) {
    ShapeUncertainty shape = map.shape(kAlpha);
    shape.whole.position_m *= stated;
    shape.whole.rotation_rad *= stated;
    for (auto& stretches : shape.sag)
      for (ShapeSigma& sigma : stretches) sigma = {stated * sigma.position_m, stated * sigma.rotation_rad};
    const ChainAgreement agreement(all_of(map.nodes()), &shape, 1, config);
    const auto server = test::corridor(map.nodes());
    int alarms = 0;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed)
      alarms += agreement.compare(server, map.displace(server, Rng(seed))).disagrees() ? 1 : 0;
    return static_cast<double>(alarms) / kSeeds;
  }
  static constexpr int kSeeds = 300;
};

// The first look has half of the mission's rate: 0.2 of 0.4. Bounded from above by 2.5 binomial sigmas.
TEST_P(Calibration, FalseAlarmsStayBelowWhatIsAsked) {
  TUTTI_STATISTIC();
  AgreementConfig config = with_signal(GetParam());
  config.false_alarm_rate = 0.4;
  // Relative motion sees a position error that goes with a turn at the turn only; these errors are independent.
  const double radians = config.signal == std::string("relative_motion") ? 1e-6 : 3e-4;
  for (const std::size_t every : {25U, 200U}) {
    const WalkWithClosures map(kNodes, every, {0.005, radians}, {0.01, 3.0 * radians});
    const double rate = false_alarms(map, config);
    std::printf("[ MEASURED ] %s, a closure every %zu nodes: %.3f of 0.2 asked for\n", GetParam(), every, rate);
    EXPECT_LE(rate, 0.2 + 2.5 * std::sqrt(0.2 * 0.8 / kSeeds)) << "a closure every " << every << " nodes";
  }
}

// And the thresholds are not much wider than need be: a map that is 1.4 times as wrong as it says is found out more
// often than false alarms are asked for, one that is twice as wrong nearly always.
TEST_P(Calibration, AMapThatIsLessSureThanItSaysIsFoundOut) {
  TUTTI_STATISTIC();
  AgreementConfig config = with_signal(GetParam());
  config.false_alarm_rate = 0.4;
  const double slightly = false_alarms(usual_map(kNodes), config, 0.7);
  std::printf("[ MEASURED ] %s, stated sigma 0.7 of the true one: %.3f\n", GetParam(), slightly);
  EXPECT_GT(slightly, 0.2);
  EXPECT_GT(false_alarms(usual_map(kNodes), config, 0.5), 0.95);
}

INSTANTIATE_TEST_SUITE_P(Signals, Calibration, testing::Values("pose", "relative_motion"));

/// Every second closed node with the one half the run ahead.
std::vector<std::pair<std::uint32_t, std::uint32_t>> closed_pairs(std::size_t nodes, std::size_t every) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> out;
  for (std::size_t a = 0; a + nodes / 2 < nodes; a += 2 * every)
    out.emplace_back(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(a + nodes / 2));
  return out;
}

// As above, of ties alone: their third of the rate.
TEST(Ties, FalseAlarmsStayBelowWhatIsAskedAndTooSureAMapIsFoundOut) {
  TUTTI_STATISTIC();
  constexpr std::size_t kNodes = 200;
  constexpr int kSeeds = 300;
  AgreementConfig config;
  config.tests = "ties";
  config.false_alarm_rate = 0.4;
  const WalkWithClosures map = usual_map(kNodes);
  const auto server = test::corridor(kNodes);
  for (const double stated : {1.0, 0.5}) {
    ShapeUncertainty shape = map.shape(kAlpha);
    shape.ties = map.ties(server, closed_pairs(kNodes, 25));
    ASSERT_EQ(shape.ties.size(), 2U);
    for (ShapeTie& tie : shape.ties) tie.sigma = {stated * tie.sigma.position_m, stated * tie.sigma.rotation_rad};
    const ChainAgreement agreement(all_of(kNodes), &shape, 1, config);
    int alarms = 0;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed)
      alarms += agreement.compare(server, map.displace(server, Rng(seed))).disagrees() ? 1 : 0;
    const double rate = static_cast<double>(alarms) / kSeeds, asked = 0.2 / 3.0;
    std::printf("[ MEASURED ] ties, stated sigma %.1f of the true one: %.3f of %.3f asked for\n", stated, rate, asked);
    if (stated == 1.0)
      EXPECT_LE(rate, asked + 2.5 * std::sqrt(asked * (1.0 - asked) / kSeeds));
    else
      EXPECT_GT(rate, 2.0 * asked);
  }
}

// A long loop of which the map knows little along the way, but that it closes: a robot that misses the closing is off
// by less than the map expects of itself, everywhere.
TEST(Ties, TellWhatNoStretchDoes) {
  constexpr std::size_t kNodes = 200;
  const WalkWithClosures map(kNodes, kNodes, {0.3, 1e-4}, {0.3, 1e-4});
  const auto server = test::corridor(kNodes);
  ShapeUncertainty shape = map.shape(kAlpha);
  auto robot = server;
  for (std::size_t n = 0; n < kNodes; ++n)
    robot[n].translation.y() += 1.5 * static_cast<double>(n) / static_cast<double>(kNodes);
  EXPECT_FALSE(ChainAgreement(all_of(kNodes), &shape, 1, {}).compare(server, robot).disagrees());
  shape.ties = {{10, 110, {0.5, 0.1}}, {10, 190, {0.1, 0.1}}, {50, 150, {0.1, 1e-3}}};
  const auto missed = ChainAgreement(all_of(kNodes), &shape, 1, {}).compare(server, robot);
  EXPECT_TRUE(missed.disagrees());
  ASSERT_EQ(missed.missed_ties.size(), 2U);  // the largest first; the first tie is not missed
  EXPECT_EQ(missed.missed_ties[0].a, 10U);
  EXPECT_EQ(missed.missed_ties[0].b, 190U);
  EXPECT_NEAR(missed.missed_ties[0].position_m, 1.5 * 180.0 / 200.0, 1e-9);
  EXPECT_NEAR(missed.missed_ties[0].rotation_rad, 0.0, 1e-6);
  EXPECT_GT(missed.missed_ties[0].significance, missed.missed_ties[1].significance);
  EXPECT_GT(missed.missed_ties[1].significance, 1.0);

  // Wherever the two lie among the server's nodes; a tie with an end that is not synchronised says nothing.
  std::vector<std::size_t> ranks = all_of(kNodes);
  std::erase(ranks, 10U);
  robot.erase(robot.begin() + 10);
  auto fewer = server;
  fewer.erase(fewer.begin() + 10);
  const auto left = ChainAgreement(ranks, &shape, 1, {}).compare(fewer, robot);
  ASSERT_EQ(left.missed_ties.size(), 1U);
  EXPECT_EQ(left.missed_ties[0].a, 49U);
  EXPECT_EQ(left.missed_ties[0].b, 149U);
}

// What to test is a setting.
TEST(Ties, EitherKindAlone) {
  constexpr std::size_t kNodes = 100;
  const WalkWithClosures map = usual_map(kNodes);
  const auto server = test::corridor(kNodes);
  ShapeUncertainty shape = map.shape(kAlpha);
  shape.ties = map.ties(server, {{0, 75}});
  auto robot = server;
  for (std::size_t n = 60; n < kNodes; ++n) robot[n].translation.z() += 3.0;
  AgreementConfig config;
  config.tests = "wavelets";
  const auto wavelets = ChainAgreement(all_of(kNodes), &shape, 1, config).compare(server, robot);
  config.tests = "ties";
  const auto ties = ChainAgreement(all_of(kNodes), &shape, 1, config).compare(server, robot);
  EXPECT_TRUE(wavelets.missed_ties.empty());
  EXPECT_GT(wavelets.significance.maxCoeff(), 1.0);
  EXPECT_EQ(ties.missed_ties.size(), 1U);
  EXPECT_EQ(ties.significance.maxCoeff(), 0.0);
  EXPECT_EQ(ties.scale_significance.maxCoeff(), 0.0);
  shape.ties.clear();
  EXPECT_FALSE(ChainAgreement(all_of(kNodes), &shape, 1, config).compare(server, robot).disagrees());
}

// All looks of one mission together: the run grows, with it the number of updates.
TEST(Mission, FalseAlarmsOfAllUpdatesTogetherStayBelowTheRate) {
  TUTTI_STATISTIC();
  constexpr std::size_t kPerUpdate = 15, kUpdates = 16;
  constexpr int kSeeds = 100;
  AgreementConfig config;
  config.false_alarm_rate = 0.3;
  const WalkWithClosures map = usual_map(kPerUpdate * kUpdates);
  std::vector<ChainAgreement> looks;
  for (std::size_t update = 1; update <= kUpdates; ++update) {
    // Cut off here the errors are those of the whole map, not those of a map of its own: marginals of one Gaussian.
    const ShapeUncertainty shape = map.shape(kAlpha, kPerUpdate * update);
    looks.emplace_back(all_of(kPerUpdate * update), &shape, update, config);
  }
  const auto server = test::corridor(map.nodes());
  int alarmed = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const auto robot = map.displace(server, Rng(seed));
    alarmed += std::ranges::any_of(looks, [&](const ChainAgreement& look) {
      const auto n = static_cast<std::size_t>(look.nodes());
      return look.compare(std::span(server).first(n), std::span(robot).first(n)).disagrees();
    });
  }
  std::printf("[ MEASURED ] %d of %d missions alarmed, at most %.0f asked for\n", alarmed, kSeeds, 0.3 * kSeeds);
  EXPECT_LE(alarmed, 30 + 2.5 * std::sqrt(kSeeds * 0.3 * 0.7));
}

class Sees : public testing::Test {
 protected:
  static constexpr std::size_t kNodes = 200;
  WalkWithClosures map_ = usual_map(kNodes);
  ShapeUncertainty shape_ = map_.shape(kAlpha);
  std::vector<Pose3> server_ = test::corridor(kNodes);
  [[nodiscard]] ChainDisagreement compare(const std::string& signal, const std::vector<Pose3>& robot) const {
    return ChainAgreement(all_of(kNodes), &shape_, 1, with_signal(signal)).compare(server_, robot);
  }
  /// Of 20 robots that differ from the map by its own uncertainty and by `change`.
  template <class Change>
  [[nodiscard]] int seen(const std::string& signal, const Change& change) const {
    int count = 0;
    for (std::uint64_t seed = 0; seed < 20; ++seed)
      count += compare(signal, change(map_.displace(server_, Rng(seed)))).disagrees() ? 1 : 0;
    return count;
  }
};

// A slow swing that, aligned, is off by a few times what the server says of the whole.
TEST_F(Sees, DriftOfSeveralSigma) {
  const auto swinging = [&](double amplitude) {
    return [&, amplitude](std::vector<Pose3> robot) {
      for (std::size_t n = 0; n < robot.size(); ++n)
        robot[n].translation.z() += amplitude * std::sin(4.0 * std::numbers::pi * static_cast<double>(n) / kNodes);
      return robot;
    };
  };
  const Eigen::MatrixXd unit = PoseSignal().difference(server_, swinging(1.0)(server_));
  const double sigma = shape_.whole.position_m / (unit.leftCols<3>().norm() / std::sqrt(1.0 * kNodes));
  EXPECT_EQ(seen("pose", swinging(3.0 * sigma)), 20);
  EXPECT_LE(seen("pose", swinging(0.5 * sigma)), 1);
}

TEST_F(Sees, SpinWithEverySignalButDistance) {
  const auto spin = [](std::vector<Pose3> robot) {
    const Pose3 turn =
        robot[0] * Pose3{so3_exp(Eigen::Vector3d(0, 0, 20 * kRadPerDeg)), Eigen::Vector3d::Zero()} * robot[0].inverse();
    for (std::size_t n = kNodes / 2; n < kNodes; ++n) robot[n] = turn * robot[n];
    return robot;
  };
  EXPECT_EQ(seen("pose", spin), 20);
  EXPECT_EQ(seen("relative_motion", spin), 20);
  EXPECT_FALSE(compare("distance", spin(server_)).disagrees());
}

TEST_F(Sees, HeightWithPoseAndRelativeMotionEachInItsPlace) {
  const auto raised = [](std::vector<Pose3> robot) {
    for (std::size_t n = 120; n < kNodes; ++n) robot[n].translation.z() += 3.0;
    return robot;
  };
  EXPECT_EQ(seen("pose", raised), 20);
  EXPECT_EQ(seen("relative_motion", raised), 20);
  Eigen::Index node = 0;
  compare("relative_motion", raised(server_)).significance.rightCols<1>().maxCoeff(&node);
  EXPECT_NEAR(static_cast<double>(node), 120.0, 1.0);
}

// Equal poses agree whatever the frames; the statement is about the difference only.
TEST_F(Sees, NothingWhereThereIsNothing) {
  Rng rng(5);
  for (const char* signal : {"distance", "pose", "relative_motion"}) {
    const auto none = compare(signal, test::moved(test::random_pose(rng, 30.0), server_));
    EXPECT_LT(none.significance.maxCoeff(), 1e-6) << signal;
    EXPECT_LT(none.scale_significance.maxCoeff(), 1e-6) << signal;
  }
}

// Where the server knows its map less well, it allows for more.
TEST(Thresholds, AreWiderWhereTheServerIsLessSure) {
  ShapeUncertainty shape = usual_map(257).shape(kAlpha);
  for (auto& stretches : shape.sag)
    for (std::size_t i = stretches.size() / 2; i < stretches.size(); ++i) stretches[i].position_m *= 5.0;
  shape.whole.position_m *= 5.0;
  const ChainAgreement agreement(all_of(257), &shape, 1, {});
  const auto& t = agreement.threshold_m();
  for (int s = agreement.scales() - 4; s < agreement.scales(); ++s) {
    EXPECT_GT(t(220, s), 3.0 * t(30, s)) << "scale " << s;
    EXPECT_NEAR(agreement.threshold_rad()(220, s) / agreement.threshold_rad()(30, s), 1.0, 0.2) << "scale " << s;
  }
}

// Scaling all that the server says scales what it allows for, but for what the wire rounds poses to.
RC_GTEST_PROP(Thresholds, GrowWithTheUncertaintyAndWithTheNumberOfUpdates, ()) {
  const auto nodes = *rc::gen::inRange<std::size_t>(2, 150);
  const double factor = *rc::gen::inRange(2, 20);
  const WalkWithClosures map(nodes, 25, {0.5, 0.03}, {1.0, 0.1});
  const WalkWithClosures wider(nodes, 25, {0.5 * factor, 0.03 * factor}, {factor, 0.1 * factor});
  const ShapeUncertainty a = map.shape(kAlpha), b = wider.shape(kAlpha);
  const ChainAgreement narrow(all_of(nodes), &a, 1, {}), wide(all_of(nodes), &b, 1, {}),
      later(all_of(nodes), &a, 9, {});
  RC_ASSERT((wide.threshold_m() - factor * narrow.threshold_m()).cwiseAbs().maxCoeff() <
            0.01 * wide.threshold_m().maxCoeff());
  RC_ASSERT((later.threshold_m() - narrow.threshold_m()).minCoeff() > 0.0);
}

// A run too short for a single stretch has empty sags: the whole bounds what may be there.
TEST(Thresholds, OfShortRunsComeFromTheWhole) {
  for (const std::size_t nodes : {2U, 3U, 8U}) {
    const WalkWithClosures map(nodes, 25, {0.005, 3e-4}, {0.01, 1e-3});
    const ShapeUncertainty shape = map.shape(kAlpha);
    ASSERT_TRUE(shape.sag.empty());
    const ChainAgreement agreement(all_of(nodes), &shape, 1, {});
    EXPECT_GT(agreement.threshold_m().minCoeff(), 0.0);
    EXPECT_LT(agreement.threshold_m().maxCoeff(), 20.0 * shape.whole.position_m);
    const auto server = test::corridor(nodes);
    int alarms = 0;
    for (std::uint64_t seed = 0; seed < 100; ++seed)
      alarms += agreement.compare(server, map.displace(server, Rng(seed))).disagrees() ? 1 : 0;
    EXPECT_LE(alarms, 2) << nodes << " nodes";  // 0.5 asked for
    auto robot = server;
    robot.back().translation.x() += 40.0 * shape.whole.position_m;
    EXPECT_TRUE(agreement.compare(server, robot).disagrees()) << nodes << " nodes";
  }
}

TEST(Thresholds, FewerThanTwoNodesNeverDisagree) {
  const ShapeUncertainty shape{.chain = kAlpha, .whole = {0.01, 0.001}};
  for (const std::size_t nodes : {0U, 1U}) {
    const auto poses = test::corridor(nodes);
    const ChainAgreement agreement(all_of(nodes), &shape, 1, {});
    EXPECT_EQ(agreement.nodes(), static_cast<Eigen::Index>(nodes));
    EXPECT_FALSE(agreement.compare(poses, test::moved(test::at(1, 2, 3), poses)).disagrees());
  }
}

// Asked for, or for want of a shape: the same everywhere, whatever the run.
TEST(Thresholds, AbsoluteOnesHoldEverywhere) {
  AgreementConfig config;
  config.threshold_m = 0.2;
  config.threshold_deg = 2.0;
  const ShapeUncertainty shape = usual_map(100).shape(kAlpha);
  const ChainAgreement missing(all_of(100), nullptr, 1, config);
  config.thresholds = "absolute";
  const ChainAgreement absolute(all_of(100), &shape, 7, config);
  for (const ChainAgreement* agreement : {&missing, &absolute}) {
    EXPECT_TRUE((agreement->threshold_m().array() == 0.2).all());
    EXPECT_TRUE((agreement->threshold_rad().array() == 2.0 * kRadPerDeg).all());
    // A wave of one length has all of its amplitude in two neighbouring scales at most.
    const auto wave = [&](double amplitude) {
      Eigen::MatrixXd f = Eigen::MatrixXd::Zero(100, 6);
      for (int n = 0; n < 100; ++n) f(n, 1) = amplitude * std::cos(std::numbers::pi * 12.0 * (n + 0.5) / 100.0);
      return agreement->compare(f);
    };
    EXPECT_TRUE(wave(0.3).disagrees());
    EXPECT_FALSE(wave(0.19).disagrees());
  }
}

// Only what the robot has synchronised is compared, where it lies among the server's nodes.
TEST(Thresholds, FollowTheRanksOfTheSynchronisedNodes) {
  ShapeUncertainty shape = usual_map(257).shape(kAlpha);
  for (auto& stretches : shape.sag)
    for (std::size_t i = 0; i < stretches.size() / 2; ++i) stretches[i].position_m *= 5.0;
  shape.whole.position_m *= 5.0;
  std::vector<std::size_t> late = all_of(100);
  for (std::size_t& rank : late) rank += 157;
  const ChainAgreement first(all_of(100), &shape, 1, {}), last(late, &shape, 1, {});
  const int s = first.scales() - 2;
  EXPECT_GT(first.threshold_m()(50, s), 3.0 * last.threshold_m()(50, s));
}

TEST(Scales, GrowLongerTowardsScaleZeroAndMoreWithTheRun) {
  int before = 0;
  for (const std::size_t nodes : {2U, 10U, 50U, 300U, 1500U}) {
    const ChainAgreement agreement(all_of(nodes), nullptr, 1, {});
    EXPECT_GE(agreement.scales(), std::max(2, before));
    before = agreement.scales();
    EXPECT_EQ(agreement.scale_length(0), static_cast<double>(nodes));
    for (int s = 1; s < agreement.scales(); ++s)
      EXPECT_GT(agreement.scale_length(s - 1), agreement.scale_length(s)) << nodes << " nodes, scale " << s;
    EXPECT_NEAR(agreement.scale_length(agreement.scales() - 1), 1.0, 1e-9);  // up and down from node to node
  }
}

// A wave of the half-length that a scale is said to hold stands out most there or in its neighbours (bands overlap).
TEST(Scales, HoldWavesOfTheirLength) {
  AgreementConfig config;
  config.thresholds = "absolute";
  const ChainAgreement agreement(all_of(512), nullptr, 1, config);
  for (int s = 2; s + 1 < agreement.scales(); ++s) {
    Eigen::MatrixXd f = Eigen::MatrixXd::Zero(512, 6);
    for (int n = 0; n < 512; ++n) f(n, 0) = std::cos(std::numbers::pi * n / agreement.scale_length(s));
    Eigen::Index node = 0, scale = 0;
    agreement.compare(f).position_m.middleRows(100, 312).maxCoeff(&node, &scale);
    EXPECT_NEAR(static_cast<double>(scale), s, 1.0) << "half a wave of " << agreement.scale_length(s) << " nodes";
  }
}

}  // namespace
}  // namespace tutti::consistency
