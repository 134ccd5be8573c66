// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/odometry_fit.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <string>

#include "support/random_pose.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti::fit {
namespace odometry_fit_test {

constexpr Timestamp kStart{1'700'000'000'000'000'000LL};
constexpr double kDuration_s = 80.0, kOdometryStep_s = 0.05, kScanStep_s = 0.5;

/// A walk through a hall: turns of changing sharpness, pauses, a gait that sways.
Trajectory walk() {
  Trajectory out;
  double yaw = 0.3, x = 2.0, y = -1.0;
  for (double t = -6.0; t < kDuration_s + 6.0; t += kOdometryStep_s) {
    const double speed = std::fmod(t + 100.0, 23.0) < 3.0 ? 0.0 : 0.8 + 0.2 * std::sin(0.31 * t);
    yaw += kOdometryStep_s * 0.5 * (std::sin(0.43 * t) + 0.6 * std::sin(1.1 * t + 1.0)) * (speed > 0.0 ? 1.0 : 0.0);
    x += kOdometryStep_s * speed * std::cos(yaw);
    y += kOdometryStep_s * speed * std::sin(yaw);
    const Eigen::Vector3d sway(0.03 * std::sin(5.0 * t), 0.02 * std::cos(4.1 * t), 0.0);
    out.push_back({kStart + t, {so3_exp({0, 0, yaw}) * so3_exp(sway), {x, y, 0.5 + 0.02 * std::sin(6.0 * t)}}});
  }
  return out;
}

/// A robot as its files are: what odometry says, and what the scans show with the stated pose of the LiDAR.
struct Robot {
  Trajectory truth = walk(), odometry = truth;
  Pose3 T_body_lidar{so3_exp({0.0, 0.1, 0.0}), {0.2, 0.0, 0.3}}, stated = T_body_lidar;
  double scans_late_s = 0.0;
  bool mirrored = false, moved = false;
  double sigma_m = 0.005, sigma_rad = 0.1 * kRadPerDeg;

  [[nodiscard]] std::vector<ScanStep> steps(std::uint64_t seed = 1) const {
    Rng rng(seed);
    std::vector<ScanStep> out;
    for (double t = 0.0; t + kScanStep_s < kDuration_s; t += kScanStep_s) {
      const Timestamp from = kStart + t, to = kStart + (t + kScanStep_s);
      Pose3 lidar = (*pose_at(truth, from) * T_body_lidar).inverse() * (*pose_at(truth, to) * T_body_lidar);
      if (moved) lidar = {};
      if (mirrored) {
        lidar.translation.y() *= -1.0;
        const Eigen::Quaterniond q = lidar.rotation;
        lidar.rotation = Eigen::Quaterniond(q.w(), -q.x(), q.y(), -q.z());
      }
      Vector6d noise;
      for (int k = 0; k < 6; ++k) noise[k] = rng.normal(k < 3 ? sigma_m : sigma_rad);
      ScanStep step{.from = from + scans_late_s, .to = to + scans_late_s};
      step.T_from_to = retract(stated * lidar * stated.inverse(), noise);
      step.covariance = diagonal_covariance(sigma_m, sigma_rad);
      out.push_back(step);
    }
    return out;
  }
  [[nodiscard]] OdometryFit fit(std::uint64_t seed = 1) const { return fit_odometry(steps(seed), odometry); }
};

/// Odometry made of the truth's steps, each changed.
Trajectory with_steps(const Trajectory& truth, const std::function<Pose3(const Pose3&)>& change) {
  Trajectory out{truth.front()};
  for (std::size_t k = 1; k < truth.size(); ++k)
    out.push_back({truth[k].stamp, out.back().pose * change(truth[k - 1].pose.inverse() * truth[k].pose)});
  return out;
}

Trajectory with_poses(Trajectory odometry, const std::function<Pose3(const Pose3&)>& change) {
  for (StampedPose& sample : odometry) sample.pose = change(sample.pose);
  return odometry;
}

struct Case {
  std::string name;
  std::function<void(Robot&)> spoil;
  MisfitKind kind;
  std::optional<double> value;
  double tolerance = 0.0;
};

const std::vector<Case>& cases() {
  using Pose = const Pose3&;
  static const std::vector<Case> all{
      {"scans 0.6 s late", [](Robot& r) { r.scans_late_s = 0.6; }, MisfitKind::clock, -0.6, 0.01},
      {"scans 0.06 s late", [](Robot& r) { r.scans_late_s = 0.06; }, MisfitKind::clock, -0.06, 0.01},
      {"scans 3 s early", [](Robot& r) { r.scans_late_s = -3.0; }, MisfitKind::clock, 3.0, 0.02},
      {"yaw 2",
       [](Robot& r) {
         r.stated.rotation = so3_exp({0, 0, 2.0 * kRadPerDeg}) * r.stated.rotation;
       },
       MisfitKind::turned, 2.0, 0.2},
      {"pitch 1.5",
       [](Robot& r) {
         r.stated.rotation = so3_exp({0, 1.5 * kRadPerDeg, 0}) * r.stated.rotation;
       },
       MisfitKind::turned, 1.5, 0.3},
      {"yaw 90",
       [](Robot& r) {
         r.stated.rotation = so3_exp({0, 0, 90.0 * kRadPerDeg}) * r.stated.rotation;
       },
       MisfitKind::turned, 90.0, 0.5},
      {"4 m ahead", [](Robot& r) { r.stated.translation.x() += 4.0; }, MisfitKind::displaced, 4.0, 0.1},
      {"0.3 m left", [](Robot& r) { r.stated.translation.y() += 0.3; }, MisfitKind::displaced, 0.3, 0.05},
      {"head down",
       [](Robot& r) {
         r.stated.rotation = so3_exp({180.0 * kRadPerDeg, 0, 0}) * r.stated.rotation;
       },
       MisfitKind::upside_down, std::nullopt},
      {"mirrored", [](Robot& r) { r.mirrored = true; }, MisfitKind::upside_down, std::nullopt},
      {"NED and FRD",
       [](Robot& r) {
         const Pose3 ned{Eigen::Quaterniond(0, std::sqrt(0.5), std::sqrt(0.5), 0), Eigen::Vector3d::Zero()};
         const Pose3 frd{Eigen::Quaterniond(0, 1, 0, 0), Eigen::Vector3d::Zero()};
         r.odometry = with_poses(r.odometry, [&](Pose T) { return ned * T * frd; });
       },
       MisfitKind::upside_down, std::nullopt},
      {"NED positions",
       [](Robot& r) {
         r.odometry = with_poses(r.odometry, [](Pose T) {
           return Pose3{T.rotation, {T.translation.y(), T.translation.x(), -T.translation.z()}};
         });
       },
       MisfitKind::positions_ned, std::nullopt},
      {"inverse", [](Robot& r) { r.odometry = with_poses(r.odometry, [](Pose T) { return T.inverse(); }); },
       MisfitKind::inverse_poses, std::nullopt},
      {"inverse attitudes",
       [](Robot& r) {
         r.odometry = with_poses(r.odometry, [](Pose T) { return Pose3{T.rotation.conjugate(), T.translation}; });
       },
       MisfitKind::inverse_attitudes, std::nullopt},
      {"w written first, read last",
       [](Robot& r) {
         r.odometry = with_poses(r.odometry, [](Pose T) {
           const Eigen::Quaterniond& q = T.rotation;
           return Pose3{Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), T.translation};
         });
       },
       MisfitKind::w_first, std::nullopt},
      {"moved already", [](Robot& r) { r.moved = true; }, MisfitKind::scans_stand_still, std::nullopt},
      {"5 % long",
       [](Robot& r) {
         r.odometry = with_steps(r.truth, [](Pose T) { return Pose3{T.rotation, 1.05 * T.translation}; });
       },
       MisfitKind::scale, 1.0 / 1.05, 0.01},
  };
  return all;
}

TEST(OdometryFit, EveryMistakeIsNamedWithItsSizeAndNothingElseIs) {
  for (const Case& c : cases()) {
    Robot robot;
    c.spoil(robot);
    const OdometryFit fit = robot.fit();
    SCOPED_TRACE(c.name + fmt::format(": cost {:.2f} -> {:.2f}", fit.before, fit.after));
    for (const Misfit& misfit : fit.misfits) SCOPED_TRACE(to_string(misfit) + "; " + way_on(misfit));
    ASSERT_EQ(fit.misfits.size(), 1U) << c.name;
    EXPECT_EQ(to_string(fit.misfits[0].kind), to_string(c.kind)) << c.name;
    EXPECT_NEAR(fit.misfits[0].value, c.value.value_or(fit.misfits[0].value), c.tolerance) << c.name;
    EXPECT_LT(fit.after, fit.before) << c.name;
  }
}

TEST(OdometryFit, HonestRobotsAreLeftAlone) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Robot robot;
    robot.sigma_m = seed % 2 == 0 ? 0.005 : 0.03;
    robot.sigma_rad = (seed % 2 == 0 ? 0.1 : 0.5) * kRadPerDeg;
    Rng rng(seed);
    robot.odometry = with_steps(robot.truth, [&](const Pose3& T) {
      const double metres = std::sqrt(T.translation.norm());
      Vector6d noise;
      for (int k = 0; k < 6; ++k) noise[k] = rng.normal((k < 3 ? 0.01 : 0.1 * kRadPerDeg) * metres);
      return retract(T, noise);
    });
    const OdometryFit fit = robot.fit(seed);
    EXPECT_TRUE(fit.misfits.empty()) << "seed " << seed << ": " << to_string(fit.misfits[0]);
    EXPECT_GT(fit.steps, 100U);
  }
}

TEST(OdometryFit, CorrectedByWhatIsFoundItFits) {
  Robot robot;
  robot.stated = Pose3{so3_exp({0, 0, 3.0 * kRadPerDeg}), {0, 0, 0}} * robot.stated;
  const OdometryFit fit = robot.fit();
  ASSERT_EQ(fit.misfits.size(), 1U);
  robot.stated = fit.misfits[0].T_correction * robot.stated;
  EXPECT_TRUE(robot.fit().misfits.empty());
  EXPECT_LT((robot.stated.inverse() * robot.T_body_lidar).translation.norm(), 0.05);
  EXPECT_LT(rotation_angle(robot.stated.inverse() * robot.T_body_lidar), 0.3 * kRadPerDeg);
}

TEST(OdometryFit, OdometryThatStoodStillIsNamedWithItsTime) {
  Robot robot;
  const Timestamp from = kStart + 24.0, to = kStart + 29.0;
  const Pose3 before = *pose_at(robot.truth, from), after = *pose_at(robot.truth, to);
  for (StampedPose& sample : robot.odometry)
    if (sample.stamp > from) sample.pose = sample.stamp < to ? before : before * after.inverse() * sample.pose;
  const OdometryFit fit = robot.fit();
  ASSERT_EQ(fit.misfits.size(), 1U);
  EXPECT_EQ(fit.misfits[0].kind, MisfitKind::stood_still);
  EXPECT_NEAR(fit.misfits[0].from - from, 0.0, 0.5);
  EXPECT_NEAR(fit.misfits[0].to - to, 0.0, 0.5);
  EXPECT_GT(fit.misfits[0].value, 2.0);
}

TEST(OdometryFit, AlongACorridorTheScansSayNothing) {
  Robot robot;
  std::vector<ScanStep> steps = robot.steps();
  for (ScanStep& step : steps) {  // they slide along x, which odometry measures 8 % too long
    step.covariance(0, 0) = 4.0;
    const Eigen::Vector3d ahead = step.T_from_to.rotation.conjugate() * step.T_from_to.translation;
    step.T_from_to = retract(step.T_from_to, (Vector6d() << -ahead.x(), 0, 0, 0, 0, 0).finished());
  }
  robot.odometry = with_steps(robot.truth, [](const Pose3& T) {
    return Pose3{T.rotation, {1.08 * T.translation.x(), T.translation.y(), T.translation.z()}};
  });
  const OdometryFit fit = fit_odometry(steps, robot.odometry);
  EXPECT_TRUE(fit.misfits.empty()) << to_string(fit.misfits[0]);
}

TEST(OdometryFit, FewStepsSayNothing) {
  Robot robot;
  robot.scans_late_s = 0.6;
  const std::vector<ScanStep> steps = robot.steps();
  EXPECT_TRUE(fit_odometry(std::span(steps).first(kFewestSteps - 1), robot.odometry).misfits.empty());
  EXPECT_TRUE(fit_odometry({}, {}).misfits.empty());
  EXPECT_TRUE(fit_odometry(steps, {}).misfits.empty());
}

}  // namespace odometry_fit_test
}  // namespace tutti::fit
