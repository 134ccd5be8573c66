// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/odometry.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/simulation/trajectory.hpp"

namespace tutti::simulation {
namespace odometry_test {

constexpr double kRate_hz = 8.0;

Trajectory walk(std::uint64_t seed, double duration_s) {
  WalkConfig config;
  config.duration_s = duration_s;
  config.rate_hz = kRate_hz;
  return simulate_walk(make_corridor_world({}, Rng(7)), config, {}, std::nullopt, Rng(seed));
}

/// Squared Mahalanobis distance of the error of odometry from pose `from` to `to`, divided by 6: 1 on average when the
/// covariances are honest.
double normalised_error(const Trajectory& truth, const OdometrySimulation& simulated, std::size_t from,
                        std::size_t to) {
  Matrix6d covariance = Matrix6d::Zero();
  for (std::size_t k = from; k < to; ++k)
    covariance = compound_covariance(simulated.odometry[k].pose.inverse() * simulated.odometry[k + 1].pose, covariance,
                                     simulated.increment_covariance[k]);
  const Vector6d error = local(truth[from].pose.inverse() * truth[to].pose,
                               simulated.odometry[from].pose.inverse() * simulated.odometry[to].pose);
  return squared_distance(error, covariance) / 6.0;
}

std::size_t after_distance(const Trajectory& truth, std::size_t from, double metres) {
  double travelled = 0.0;
  while (from + 1 < truth.size() && travelled < metres) {
    travelled += (truth[from + 1].pose.translation - truth[from].pose.translation).norm();
    ++from;
  }
  return from;
}

/// Mean normalised error of segments of the given length over many runs (0 = single increments).
double mean_normalised_error(const OdometryNoiseConfig& config, double segment_m, std::uint64_t runs) {
  const Trajectory truth = walk(1, 95.0);  // 50 m and a little, however slowly
  double sum = 0.0;
  double count = 0.0;
  for (std::uint64_t seed = 0; seed < runs; ++seed) {
    const OdometrySimulation simulated = simulate_odometry(truth, {}, config, Rng(seed));
    if (segment_m <= 0.0) {
      for (std::size_t k = 0; k + 1 < truth.size(); k += 50, count += 1.0)
        sum += normalised_error(truth, simulated, k, k + 1);
    } else {
      sum += normalised_error(truth, simulated, 40, after_distance(truth, 40, segment_m));
      count += 1.0;
    }
  }
  return sum / count;
}

TEST(SimulateOdometry, WhatIsGivenCountsInsteadOfTheKindsOwn) {
  for (const OdometryKind& kind : odometry_kinds()) {
    const OdometryNoiseConfig own = OdometryChoice{.kind = std::string(kind.name)}.config();
    EXPECT_EQ(own.yaw_bias_deg_per_m, kind.config.yaw_bias_deg_per_m) << kind.name;
    EXPECT_EQ(own.stated_sigma_factor, kind.config.stated_sigma_factor) << kind.name;
    OdometryChoice given{.kind = std::string(kind.name)};
    given.slide_percent = 7.0;
    given.slips_per_km = 0.0;
    given.scripted = {{.after_m = 3.0}};
    const OdometryNoiseConfig changed = given.config();
    EXPECT_EQ(changed.degeneracy.slide_percent, 7.0) << kind.name;
    EXPECT_EQ(changed.slips_per_km, 0.0) << kind.name;
    EXPECT_EQ(changed.scale_percent, kind.config.scale_percent) << kind.name;
    EXPECT_EQ(changed.scripted.size(), 1U) << kind.name;
  }
}

OdometryNoiseConfig white_noise() {
  OdometryNoiseConfig config;
  config.yaw_bias_deg_per_m = 0.0;
  config.scale_percent = 0.0;
  return config;
}

TEST(SimulateOdometry, WhiteNoiseIsExactlyHonestAtEveryLength) {
  EXPECT_NEAR(mean_normalised_error(white_noise(), 0.0, 100), 1.0, 0.1);
  EXPECT_NEAR(mean_normalised_error(white_noise(), 10.0, 300), 1.0, 0.15);
  EXPECT_NEAR(mean_normalised_error(white_noise(), 50.0, 300), 1.0, 0.15);
}

TEST(SimulateOdometry, SlowErrorsMakeShortSegmentsCautiousAndLongOnesHonest) {
  const double increments = mean_normalised_error({}, 0.0, 100);
  EXPECT_LT(increments, 1.05);
  EXPECT_GT(increments, 0.3);
  const double segments = mean_normalised_error({}, 50.0, 300);
  EXPECT_LT(segments, 1.2);
  EXPECT_GT(segments, 0.5);
}

TEST(SimulateOdometry, InflationIsWhatKeepsStrongConstantErrorsHonest) {
  OdometryNoiseConfig config;
  config.yaw_drift_deg_per_m = 0.1;
  config.scale_percent = 1.0;
  config.yaw_bias_deg_per_m = 0.02;
  const double segments = mean_normalised_error(config, 50.0, 300);
  EXPECT_LT(segments, 1.3);
  EXPECT_GT(segments, 0.3);
  // The same errors, were each increment judged alone, would be far outside.
  OdometryNoiseConfig blind = config;
  blind.consistent_length_m = 1e-3;
  EXPECT_GT(mean_normalised_error(blind, 50.0, 100), 2.0 * segments);
}

TEST(SimulateOdometry, SlipsAreNotInTheCovariance) {
  OdometryNoiseConfig config = white_noise();
  config.slips_per_km = 20.0;
  config.slip_m = 1.0;
  config.slip_deg = 10.0;
  EXPECT_GT(mean_normalised_error(config, 50.0, 100), 10.0);
}

/// Straight along x at 1 m/s.
Trajectory straight(double length_m) {
  Trajectory truth;
  for (int k = 0; k <= static_cast<int>(length_m * kRate_hz); ++k)
    truth.push_back({Timestamp{} + k / kRate_hz, {Eigen::Quaterniond::Identity(), {k / kRate_hz, 0.0, 0.0}}});
  return truth;
}

/// A corridor of this kind between two x; rough elsewhere.
std::vector<Surroundings> corridor_between(const Trajectory& truth, CorridorKind kind, double from_m, double until_m) {
  std::vector<Surroundings> out;
  for (const StampedPose& sample : truth) {
    const bool in = from_m <= sample.pose.translation.x() && sample.pose.translation.x() < until_m;
    out.push_back({.kind = in ? kind : CorridorKind::rough, .corridor = in ? 1U : 0U});
  }
  return out;
}

TEST(SimulateOdometry, FeaturelessCorridorsHideTheWayAlongThemAndTheRobotKnows) {
  const Trajectory truth = straight(50.0);
  const auto around = corridor_between(truth, CorridorKind::featureless, 10.0, 40.0);
  OdometryNoiseConfig config = white_noise();
  config.degeneracy = {.slide_percent = 4.0, .along_m_per_sqrt_m = 0.05};
  double along = 0.0, aside = 0.0, known = 0.0, half = 0.0;
  constexpr int kRuns = 400;
  for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
    const auto simulated = simulate_odometry(truth, around, config, Rng(seed));
    const std::size_t from = 80, until = 320;
    const Vector6d error = local(truth[from].pose.inverse() * truth[until].pose,
                                 simulated.odometry[from].pose.inverse() * simulated.odometry[until].pose);
    along += error.x() * error.x() / kRuns;
    aside += error.y() * error.y() / kRuns;
    known += normalised_error(truth, simulated, from, until) / kRuns;
    half += normalised_error(truth, simulated, from, from + 120) / kRuns;
    const Matrix6d& inside = simulated.increment_covariance[200];
    const Matrix6d& outside = simulated.increment_covariance[40];
    ASSERT_GT(inside(0, 0), 5.0 * outside(0, 0));   // along the axis
    ASSERT_LT(inside(1, 1), 1.01 * outside(1, 1));  // not across it
  }
  // Slide 4 % of 30 m, walk 0.05 m per root of 30 m, beside the usual walk of 0.01.
  EXPECT_NEAR(std::sqrt(along), std::hypot(1.2, 0.27), 0.12);
  EXPECT_LT(std::sqrt(aside), 0.15);
  EXPECT_NEAR(known, 1.0, 0.15);
  EXPECT_LT(half, 1.1);
  EXPECT_GT(half, 0.5);
}

TEST(SimulateOdometry, CovariancesStayHonestOnWalksThroughFeaturelessCorridors) {
  CorridorWorld world = make_corridor_world({}, Rng(7));
  for (std::size_t i = 0; i < world.corridors.size(); i += 3) world.corridors[i].kind = CorridorKind::featureless;
  const Trajectory truth = walk(1, 400.0);
  const auto around = surroundings_along(world, truth);
  for (const double segment_m : {1.0, 10.0, 30.0, 100.0}) {
    double sum = 0.0, count = 0.0;
    for (std::uint64_t seed = 0; seed < 30; ++seed) {
      const auto simulated = simulate_odometry(truth, around, {}, Rng(seed));
      for (std::size_t from = 0; from + 1 < truth.size(); from += 401, count += 1.0)
        sum += normalised_error(truth, simulated, from, after_distance(truth, from, segment_m));
    }
    EXPECT_LT(sum / count, 1.5) << segment_m;
    EXPECT_GT(sum / count, 0.3) << segment_m;
  }
}

RC_GTEST_PROP(SimulateOdometry, AFailureBendsTheTrajectoryInTheOpenOnceAndUnknown, ()) {
  const Trajectory truth = straight(100.0);
  const auto around = corridor_between(truth, CorridorKind::open, 20.0, *rc::gen::element(40.0, 90.0));
  OdometryNoiseConfig config = white_noise();
  config.translation_m_per_sqrt_m = config.yaw_deg_per_sqrt_m = config.tilt_deg_per_sqrt_m = 0.0;
  const bool turns = *rc::gen::arbitrary<bool>();
  config.failure = {.after_m = 10.0, .length_m = 30.0, .yaw_deg = turns ? 20.0 : 0.0, .drift_m = turns ? 0.0 : 1.5};
  const bool cut_short = around[400].kind == CorridorKind::rough;  // back inside before it ends
  const double share = cut_short ? 1.0 / 3.0 : 1.0;
  const auto simulated = simulate_odometry(truth, around, config, Rng(*rc::gen::arbitrary<std::uint32_t>()));
  RC_ASSERT(simulated.drift_origins.size() == 1U);
  const DriftOrigin& origin = simulated.drift_origins.front();
  RC_ASSERT(origin.kind == DriftOrigin::Kind::failure);
  RC_ASSERT(std::abs((origin.from - truth.front().stamp) - 30.0) < 0.3);
  RC_ASSERT(std::abs((origin.until - origin.from) - share * 30.0) < 0.3);
  RC_ASSERT(std::abs(origin.rotation_rad - share * config.failure.yaw_deg * kRadPerDeg) < 0.01);
  if (!turns) RC_ASSERT(std::abs(origin.translation_m - share * 1.5) < 0.02);
  for (std::size_t k = 0; k + 1 < truth.size(); ++k) {  // elsewhere nothing is wrong, and nowhere it is known
    RC_ASSERT(simulated.increment_covariance[k].isApprox(simulated.increment_covariance[0], 1e-9));
    const Vector6d error = local(truth[k].pose.inverse() * truth[k + 1].pose,
                                 simulated.odometry[k].pose.inverse() * simulated.odometry[k + 1].pose);
    const bool failing = origin.from <= truth[k].stamp && truth[k].stamp < origin.until;
    RC_ASSERT((error.norm() > 1e-3) == failing);
  }
}

TEST(SimulateOdometry, OriginsOfDriftSayWhenAndHowMuch) {
  const Trajectory truth = straight(100.0);
  const auto around = corridor_between(truth, CorridorKind::featureless, 10.0, 40.0);
  OdometryNoiseConfig config;
  config.slips_per_km = 50.0;
  config.slip_m = 1.0;
  config.slip_deg = 10.0;
  int slips = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto simulated = simulate_odometry(truth, around, config, Rng(seed));
    int stays = 0;
    Timestamp last;
    for (const DriftOrigin& origin : simulated.drift_origins) {
      EXPECT_GE(origin.from, last);
      last = origin.from;
      const auto at = [&](Timestamp stamp) {
        return static_cast<std::size_t>(std::lround((stamp - truth.front().stamp) * kRate_hz));
      };
      const std::size_t from = at(origin.from), until = at(origin.until);
      const Vector6d error = local(truth[from].pose.inverse() * truth[until].pose,
                                   simulated.odometry[from].pose.inverse() * simulated.odometry[until].pose);
      EXPECT_NEAR(origin.translation_m, error.head<3>().norm(), 1e-9);
      EXPECT_NEAR(origin.rotation_rad, error.tail<3>().norm(), 1e-9);
      if (origin.kind == DriftOrigin::Kind::slip) {
        ++slips;
        EXPECT_EQ(until, from + 1);
        EXPECT_GT(error.norm(), 10.0 * std::sqrt(simulated.increment_covariance[0].trace()));
      } else {
        ++stays;
        EXPECT_EQ(origin.kind, DriftOrigin::Kind::degeneracy);
        EXPECT_EQ(from, 80U);
        EXPECT_EQ(until, 320U);
      }
    }
    EXPECT_EQ(stays, 1);
  }
  EXPECT_NEAR(slips, 100, 30);  // 5 per run
}

OdometryNoiseConfig no_noise() {
  OdometryNoiseConfig config = white_noise();
  config.translation_m_per_sqrt_m = config.yaw_deg_per_sqrt_m = config.tilt_deg_per_sqrt_m = 0.0;
  config.floor_m = config.floor_deg = 1e-12;
  return config;
}

TEST(SimulateOdometry, SlidesAreNoSmallerThanAskedForAndToBothSides) {
  const Trajectory truth = straight(50.0);
  const auto around = corridor_between(truth, CorridorKind::featureless, 10.0, 40.0);
  OdometryNoiseConfig config = no_noise();
  config.degeneracy = {.slide_percent = 4.0, .least_slide_percent = 3.0, .along_m_per_sqrt_m = 0.0};
  int at_least = 0, ahead = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const auto simulated = simulate_odometry(truth, around, config, Rng(seed));
    const Vector6d error = local(truth.front().pose.inverse() * truth.back().pose,
                                 simulated.odometry.front().pose.inverse() * simulated.odometry.back().pose);
    ASSERT_GE(std::abs(error.x()), 0.03 * 30.0 - 1e-6);
    at_least += std::abs(error.x()) < 0.03 * 30.0 + 1e-6 ? 1 : 0;
    ahead += error.x() > 0.0 ? 1 : 0;
  }
  EXPECT_NEAR(at_least, 55, 15);  // |normal| < 0.75
  EXPECT_NEAR(ahead, 50, 15);
}

TEST(SimulateOdometry, AnOverstatedCovarianceIsLargerThanTheErrorsByItsFactor) {
  OdometryNoiseConfig config = white_noise();
  config.stated_sigma_factor = 3.0;
  EXPECT_NEAR(mean_normalised_error(config, 0.0, 100), 1.0 / 9.0, 0.012);
  EXPECT_NEAR(mean_normalised_error(config, 50.0, 300), 1.0 / 9.0, 0.02);
}

/// Error of the odometry from the first pose on, in the frame of the first pose.
Pose3 error_since_start(const Trajectory& truth, const OdometrySimulation& simulated, std::size_t k) {
  const Pose3 T_start_true = truth.front().pose.inverse() * truth[k].pose;
  return simulated.odometry.front().pose.inverse() * simulated.odometry[k].pose * T_start_true.inverse();
}

RC_GTEST_PROP(SimulateOdometry, AScriptedErrorIsWhereAndWhatItWasAskedToBe, ()) {
  const Trajectory truth = straight(100.0);
  OdometryNoiseConfig config = no_noise();
  const bool sudden = *rc::gen::arbitrary<bool>();
  const double yaw_deg = *rc::gen::inRange(-90, 91);
  const Eigen::Vector3d move(*rc::gen::inRange(-3, 4), *rc::gen::inRange(-3, 4), *rc::gen::inRange(1, 4));
  config.scripted = {{.after_m = 30.0, .length_m = sudden ? 0.0 : 20.0, .ahead_m = move.x(), .left_m = move.y()},
                     {.after_m = 60.0, .length_m = sudden ? 0.0 : 20.0, .yaw_deg = yaw_deg, .up_m = move.z()},
                     {.after_m = 200.0, .yaw_deg = 90.0}};  // never reached
  const auto simulated = simulate_odometry(truth, {}, config, Rng(*rc::gen::arbitrary<std::uint32_t>()));
  const auto known = simulate_odometry(truth, {}, no_noise(), Rng(1));
  RC_ASSERT(simulated.increment_covariance == known.increment_covariance);  // it does not know
  const std::size_t between = after_distance(truth, 0, 55.0);
  const Pose3 first = error_since_start(truth, simulated, between);
  RC_ASSERT((first.translation - Eigen::Vector3d(move.x(), move.y(), 0.0)).norm() < 1e-6);
  RC_ASSERT(rotation_angle(first) < 1e-6);
  const Pose3 at_end = error_since_start(truth, simulated, truth.size() - 1);
  RC_ASSERT(std::abs(rotation_angle(at_end) - std::abs(yaw_deg) * kRadPerDeg) < 1e-6);
  RC_ASSERT(std::abs(at_end.translation.z() - move.z()) < 1e-6);
  RC_ASSERT(simulated.drift_origins.size() == 2U);
  const DriftOrigin& origin = simulated.drift_origins[1];
  RC_ASSERT(origin.kind == (sudden ? DriftOrigin::Kind::slip : DriftOrigin::Kind::failure));
  RC_ASSERT(std::abs((origin.from - truth.front().stamp) - 60.0) < 0.3);
  RC_ASSERT(std::abs((origin.until - origin.from) - (sudden ? 1.0 / kRate_hz : 20.0)) < 0.3);
  RC_ASSERT(std::abs(origin.rotation_rad - std::abs(yaw_deg) * kRadPerDeg) < 1e-6);
}

RC_GTEST_PROP(SimulateOdometry, AnErrorAtTheStartTurnsTheRestAboutIt, ()) {
  const Trajectory truth = [] {  // twice round a circle of 20 m through the origin
    Trajectory out;
    for (int k = 0; k <= 2000; ++k) {
      const double angle = k * 4.0 * std::numbers::pi / 2000.0;
      const Eigen::Quaterniond heading(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
      out.push_back(
          {Timestamp{} + k / kRate_hz, {heading, {20.0 * std::sin(angle), 20.0 * (1.0 - std::cos(angle)), 0.0}}});
    }
    return out;
  }();
  OdometryNoiseConfig config = no_noise();
  const double yaw_deg = *rc::gen::inRange(5, 90);
  config.scripted = {{.after_m = 50.0, .at_start = true, .yaw_deg = yaw_deg}};
  const auto simulated = simulate_odometry(truth, {}, config, Rng(1));
  RC_ASSERT(simulated.drift_origins.size() == 1U);
  RC_ASSERT(std::abs((simulated.drift_origins.front().from - truth.front().stamp) - 1000.0 / kRate_hz) < 0.3);
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const Pose3 T_start_true = truth.front().pose.inverse() * truth[k].pose;
    const Pose3 T_start_odometry = simulated.odometry.front().pose.inverse() * simulated.odometry[k].pose;
    RC_ASSERT(std::abs(T_start_true.translation.norm() - T_start_odometry.translation.norm()) < 1e-6);
    const double turned = k < 1000 ? 0.0 : 2.0 * std::sin(0.5 * yaw_deg * kRadPerDeg);
    const double moved = (T_start_true.translation - T_start_odometry.translation).norm();
    RC_ASSERT(std::abs(moved - turned * T_start_true.translation.norm()) < 1e-6);
  }
}

RC_GTEST_PROP(SimulateOdometry, WithoutNoiseOnlyTheFrameDiffers, ()) {
  const auto seed = *rc::gen::arbitrary<std::uint32_t>();
  const Trajectory truth = walk(seed, 30.0);
  const OdometryNoiseConfig config = no_noise();
  const OdometrySimulation simulated = simulate_odometry(truth, {}, config, Rng(seed));
  RC_ASSERT(simulated.odometry.size() == truth.size());
  RC_ASSERT(simulated.increment_covariance.size() + 1 == truth.size());
  const Pose3 T_odom_reference = simulated.odometry.front().pose * truth.front().pose.inverse();
  for (std::size_t k = 0; k < truth.size(); ++k) {
    RC_ASSERT(simulated.odometry[k].stamp == truth[k].stamp);
    RC_ASSERT(local(T_odom_reference * truth[k].pose, simulated.odometry[k].pose).norm() < 1e-8);
  }
}

RC_GTEST_PROP(SimulateOdometry, CovariancesAreSymmetricAndPositiveDefinite, ()) {
  const Trajectory truth = walk(1, 20.0);
  const auto simulated = simulate_odometry(truth, {}, {}, Rng(*rc::gen::arbitrary<std::uint32_t>()));
  for (const Matrix6d& covariance : simulated.increment_covariance) {
    RC_ASSERT(covariance == covariance.transpose());
    RC_ASSERT(is_definite(covariance));
  }
}

TEST(SimulateOdometry, EmptyAndSinglePose) {
  EXPECT_TRUE(simulate_odometry({}, {}, {}, Rng(1)).odometry.empty());
  const auto one = simulate_odometry({StampedPose{{5}, {}}}, {}, {}, Rng(1));
  EXPECT_EQ(one.odometry.size(), 1U);
  EXPECT_TRUE(one.increment_covariance.empty());
}

}  // namespace odometry_test
}  // namespace tutti::simulation
