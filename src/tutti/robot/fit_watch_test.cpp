// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/fit_watch.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "support/perception/lidar/rooms.hpp"
#include "support/random_pose.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/robot/agent.hpp"

namespace tutti::robot {
namespace fit_watch_test {

constexpr Timestamp kStart{1'700'000'000'000'000'000LL};
constexpr double kOdometryStep_s = 0.05, kScanStep_s = 0.5, kDuration_s = 45.0;

/// Round and round in the room, sharper and less sharp.
Pose3 truth_at(double t) {
  const double u = 0.25 * t + 0.15 * std::sin(0.4 * t);
  const double du = 0.25 + 0.06 * std::cos(0.4 * t);
  const double x = 6.0 + 3.5 * std::cos(u), y = 4.5 + 2.0 * std::sin(u);
  return {so3_exp({0, 0, std::atan2(2.0 * std::cos(u) * du, -3.5 * std::sin(u) * du)}), {x, y, 1.2}};
}

struct Mission {
  double scans_late_s = 0.0, points_times = 1.0;
  double frozen_from_s = 1e9, frozen_for_s = 5.0;
  double drift_deg_per_m = 0.0;
  double duration_s = kDuration_s;
  bool in_world = false;  ///< Clouds are moved into odometry's frame, and labelled with the sensor's.
  std::string fit = "use";

  std::vector<Submap> submaps;
  std::vector<fit::Misfit> said;
  std::uint64_t registrations = 0, scans = 0;

  /// As odometry has it: it stands still for a while, and goes on from there.
  [[nodiscard]] Pose3 odometry_at(double t) const {
    if (drift_deg_per_m != 0.0) return drifted_at(t);
    if (t < frozen_from_s) return truth_at(t);
    const Pose3 stood = truth_at(frozen_from_s), moved = truth_at(frozen_from_s + frozen_for_s);
    return t < frozen_from_s + frozen_for_s ? stood : stood * moved.inverse() * truth_at(t);
  }
  [[nodiscard]] Scan scan_at(double t) const {
    const Pose3 T = truth_at(t);
    const auto seen = tutti::lidar::test::observe(
        tutti::lidar::test::furnished_room(),
        {.from = T.translation, .to = T.translation, .yaw_rad = so3_log(T.rotation).z(), .keyframes = 1},
        Rng(static_cast<std::uint64_t>(t * 1000)));
    auto cloud = std::make_shared<PointCloud>(seen);
    for (Eigen::Vector3f& p : cloud->points) p *= static_cast<float>(points_times);
    if (in_world)
      for (Eigen::Vector3f& p : cloud->points) p = (T * p.cast<double>().eval()).cast<float>();
    return {kStart + (t + scans_late_s), cloud, nullptr};
  }
  void drive() {
    AgentConfig config;
    config.submap.has_scans = true;
    config.submap.fit.scans = fit;
    RobotAgent agent(RobotId{0}, 1, config);
    const Matrix6d covariance = diagonal_covariance(1e-3, 1e-4);
    const auto every = static_cast<int>(kScanStep_s / kOdometryStep_s);
    for (int k = 0; k * kOdometryStep_s < duration_s; ++k) {
      const double t = k * kOdometryStep_s;
      ASSERT_TRUE(agent.add(OdometrySample{kStart + t, odometry_at(t), covariance}));
      if (const double of = t - scans_late_s; k % every == 0 && of >= 0.0 && agent.wants_scan(kStart + t)) {
        ASSERT_TRUE(agent.add(scan_at(of)));
        ++scans;
      }
      collect(agent);
    }
    agent.finish();
    collect(agent);
    registrations = agent.fit().registrations();
  }
  /// The largest distance of a keyframe from the truth, both as seen from the first.
  [[nodiscard]] double worst_m() const {
    double worst = 0.0;
    const Keyframe& first = submaps.front().keyframes.front();
    for (const Submap& submap : submaps)
      for (const Keyframe& k : submap.keyframes) {
        const Pose3 moved = first.T_odom_body.inverse() * k.T_odom_body;
        const Pose3 truly = truth_at(first.stamp - kStart).inverse() * truth_at(k.stamp - kStart);
        worst = std::max(worst, (moved.translation - truly.translation).norm());
      }
    return worst;
  }

 private:
  [[nodiscard]] Pose3 drifted_at(double t) const {
    Pose3 out = truth_at(0.0);
    for (double from = 0.0; from < t - 1e-9; from += kOdometryStep_s) {
      const Pose3 step = truth_at(from).inverse() * truth_at(std::min(t, from + kOdometryStep_s));
      out = out * fit::without_drift(step, step.translation.norm(), -drift_deg_per_m * kRadPerDeg);
    }
    return out;
  }
  void collect(RobotAgent& agent) {
    for (SubmapMessage& message : agent.take_outgoing()) submaps.push_back(std::move(message.submap));
    for (const fit::Misfit& misfit : agent.take_misfits()) said.push_back(misfit);
  }
};

TEST(FitWatch, AnHonestRobotIsLeftAloneAndEveryScanIsRegisteredOnce) {
  Mission run, off{.fit = "off"};
  run.drive();
  off.drive();
  EXPECT_TRUE(run.said.empty()) << to_string(run.said.front());
  EXPECT_GT(run.scans, 60U);
  EXPECT_LE(run.registrations, run.scans + run.submaps.size());  // the cost of the watch
  EXPECT_EQ(off.registrations, 0U);
  ASSERT_EQ(run.submaps.size(), off.submaps.size());
  for (std::size_t i = 0; i < run.submaps.size(); ++i) {  // to the bit
    EXPECT_EQ(run.submaps[i].keyframes, off.submaps[i].keyframes);
    EXPECT_EQ(*run.submaps[i].cloud, *off.submaps[i].cloud);
  }
}

TEST(FitWatch, ALateClockIsSaidOnce) {
  Mission run{.scans_late_s = 0.6};
  run.drive();
  ASSERT_EQ(run.said.size(), 1U);
  EXPECT_EQ(run.said[0].kind, fit::MisfitKind::clock);
  EXPECT_NEAR(run.said[0].value, -0.6, 0.03);
}

TEST(FitWatch, ACloudThatIsInTheWorldIsSaidAfterOneSubmap) {
  Mission run{.duration_s = 12.0, .in_world = true};
  run.drive();
  ASSERT_EQ(run.said.size(), 1U);
  EXPECT_EQ(run.said[0].kind, fit::MisfitKind::scans_stand_still);
}

TEST(FitWatch, PointsThatAreNotInMetresAreSaid) {
  Mission run{.points_times = 1000.0};
  run.drive();
  ASSERT_FALSE(run.said.empty());
  EXPECT_EQ(run.said[0].kind, fit::MisfitKind::far_points);
  EXPECT_GT(run.said[0].value, 1000.0);
}

TEST(FitWatch, ASteadyDriftIsTakenOutOfSubmapsAndSaid) {
  for (const double deg_per_m : {0.5, -0.5}) {
    Mission mended{.drift_deg_per_m = deg_per_m}, raw{.drift_deg_per_m = deg_per_m, .fit = "say"};
    mended.drive();
    raw.drive();
    EXPECT_GT(raw.worst_m(), 0.7);
    EXPECT_LT(mended.worst_m(), 0.5 * raw.worst_m());
    for (const Mission* mission : {&mended, &raw}) {
      ASSERT_EQ(mission->said.size(), 1U);
      EXPECT_EQ(mission->said[0].kind, fit::MisfitKind::drift);
      EXPECT_NEAR(mission->said[0].value, deg_per_m, 0.1);
    }
  }
}

/// The segment crosses the end of a submap wherever it begins: the motion over the boundary is known, too.
TEST(FitWatch, WhereOdometryStoodStillSubmapsHaveTheScansMotion) {
  for (const double from_s : {5.0, 12.3, 17.0}) {
    Mission mended{.frozen_from_s = from_s}, raw{.frozen_from_s = from_s, .fit = "say"};
    mended.drive();
    raw.drive();
    EXPECT_GT(raw.worst_m(), 2.0);
    EXPECT_LT(mended.worst_m(), 0.25) << "from " << from_s << " s";
    ASSERT_FALSE(mended.said.empty());
    EXPECT_EQ(mended.said[0].kind, fit::MisfitKind::stood_still);
    for (std::size_t i = 0; i + 1 < mended.submaps.size(); ++i)  // submaps attach
      EXPECT_LT(
          local(mended.submaps[i].keyframes.back().T_odom_body, mended.submaps[i + 1].keyframes.front().T_odom_body)
              .norm(),
          1e-9);
    for (const Submap& submap : mended.submaps)
      for (std::size_t k = 0; k < submap.odometry.size(); ++k)
        EXPECT_LT(local(submap.keyframes[k].T_odom_body.inverse() * submap.keyframes[k + 1].T_odom_body,
                        submap.odometry[k].T_a_b)
                      .norm(),
                  1e-6);
  }
}

}  // namespace fit_watch_test
}  // namespace tutti::robot
