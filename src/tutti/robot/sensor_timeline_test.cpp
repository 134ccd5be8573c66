// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/sensor_timeline.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/robot/submap_builder.hpp"

namespace tutti::robot {
namespace sensor_timeline_test {

Timestamp at(double seconds) { return Timestamp{1'700'000'000'000'000'000LL} + seconds; }

Pose3 any_pose(Rng& rng, double metres) {
  Pose3 T;
  for (double& x : T.translation) x = metres * rng.normal();
  T.rotation = Eigen::Quaterniond(1.0, 0.1 * rng.normal(), 0.1 * rng.normal(), 0.1 * rng.normal()).normalized();
  return T;
}

RC_GTEST_PROP(SensorTimeline, AStepInTwoIsTheStep, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const StampedPose from{at(0.0), any_pose(rng, 100.0)};
  Matrix6d a;
  for (double& x : a.reshaped()) x = rng.normal();
  const OdometryStep to{at(0.1), from.pose * any_pose(rng, 0.1), 1e-4 * a * a.transpose()};
  const auto [first, second] = split(from, to, at(rng.uniform(0.001, 0.099)));
  const RelativePose both = compound({from.pose.inverse() * first.T_odom_body, first.covariance},
                                     {first.T_odom_body.inverse() * second.T_odom_body, second.covariance});
  RC_ASSERT(local(both.T_a_b, from.pose.inverse() * to.T_odom_body).norm() < 1e-9);
  RC_ASSERT((both.covariance - to.covariance).norm() < 1e-9 * to.covariance.norm());
  RC_ASSERT(second.stamp == to.stamp && second.T_odom_body == to.T_odom_body);
}

/// A robot that goes straight ahead and is fed as its sensors and its odometry come.
struct Drive {
  double speed_mps = 0.5;
  double scan_hz = 10.0;
  double scan_phase_s = 0.0;
  double seconds = 30.0;

  [[nodiscard]] Pose3 pose(double t) const { return {Eigen::Quaterniond::Identity(), {speed_mps * t, 0.0, 0.0}}; }
  [[nodiscard]] std::vector<double> scan_times() const {
    std::vector<double> out;
    for (int i = 0; scan_phase_s + i / scan_hz < seconds; ++i) out.push_back(scan_phase_s + i / scan_hz);
    return out;
  }
  /// The first sample is at 0, and the others as they are asked for. A scan is heard `late_s` after its stamp.
  [[nodiscard]] std::vector<Submap> submaps(std::vector<double> odometry, double late_s, bool all = false) const {
    SubmapBuilder builder(RobotId{1}, {.has_scans = true});
    struct Heard {
      double time, stamp;
      bool is_scan;
    };
    std::vector<Heard> heard;
    odometry.insert(odometry.begin(), 0.0);
    for (const double t : odometry) heard.push_back({t, t, false});
    for (const double t : scan_times()) heard.push_back({t + late_s, t, true});
    std::ranges::stable_sort(heard, {}, [](const Heard& h) { return std::pair(h.time, h.is_scan); });
    double before = 0.0;
    for (const Heard& h : heard) {
      if (h.is_scan) {
        if (all || builder.wants_scan(at(h.stamp))) {
          const auto cloud = std::make_shared<const PointCloud>(PointCloud{{{5.0F, 3.0F, 1.0F}}});
          const auto ok = builder.add(Scan{at(h.stamp), cloud, {}});
          EXPECT_TRUE(ok.has_value()) << ok.error().message;
        }
        continue;
      }
      Vector6d variance;
      variance << Eigen::Vector3d::Constant(1e-4), Eigen::Vector3d::Constant(1e-6);
      const Matrix6d covariance = (h.stamp - std::exchange(before, h.stamp)) * Matrix6d(variance.asDiagonal());
      EXPECT_TRUE(builder.add(OdometrySample{at(h.stamp), pose(h.stamp), covariance}).has_value());
    }
    builder.finish();
    EXPECT_TRUE(builder.take_scan_errors().empty());
    std::vector<Submap> out;
    for (const FinishedSubmap& finished : builder.state().finished) scans_.push_back(finished.scans.size());
    while (auto submap = builder.take_submap()) out.push_back(std::move(*submap));
    return out;
  }
  mutable std::vector<std::size_t> scans_;  // of each submap
};

Drive any_drive() {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  Drive drive{.speed_mps = rng.uniform(0.0, 2.0), .scan_hz = rng.uniform(5.0, 20.0), .scan_phase_s = 0.0};
  drive.scan_phase_s = rng.uniform(0.0, 1.0 / drive.scan_hz);
  return drive;
}

void expect_same(const std::vector<Submap>& a, const std::vector<Submap>& b) {
  RC_ASSERT(a.size() == b.size());
  for (std::size_t s = 0; s < a.size(); ++s) {
    RC_ASSERT(a[s].keyframes.size() == b[s].keyframes.size());
    for (std::size_t k = 0; k < a[s].keyframes.size(); ++k) {
      RC_ASSERT(a[s].keyframes[k].stamp == b[s].keyframes[k].stamp);
      RC_ASSERT(a[s].keyframes[k].representative == b[s].keyframes[k].representative);
      RC_ASSERT(local(a[s].keyframes[k].T_odom_body, b[s].keyframes[k].T_odom_body).norm() < 1e-6);
    }
    for (std::size_t k = 0; k < a[s].odometry.size(); ++k) {
      const Vector6d one = a[s].odometry[k].covariance.diagonal(), other = b[s].odometry[k].covariance.diagonal();
      RC_ASSERT(((one - other).array().abs() <= 0.05 * one.array()).all());  // levers are counted from sample to sample
    }
    RC_ASSERT((a[s].cloud == nullptr) == (b[s].cloud == nullptr));
    if (a[s].cloud) {
      RC_ASSERT(a[s].cloud->points.size() == b[s].cloud->points.size());
    }
  }
}

// Whatever the odometry's rate and phase, and however late scans are within the lag, also before their odometry: the
// keyframes are those of a robot whose odometry is at its scans' stamps.
RC_GTEST_PROP(SensorTimeline, TheRateOfOdometryDoesNotChangeTheMap, ()) {
  const Drive drive = any_drive();
  const auto same = drive.submaps(drive.scan_times(), 0.0);
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const double rate_hz = std::exp(rng.uniform(std::log(10.0), std::log(1000.0)));
  std::vector<double> odometry;
  for (double t = rng.uniform(0.001, 1.0) / rate_hz; t < drive.scan_times().back() + 1.0 / rate_hz; t += 1.0 / rate_hz)
    odometry.push_back(t);
  const bool all = rng.bernoulli(0.5);  // or only those that are wanted
  Drive fast = drive;
  const auto other = fast.submaps(odometry, rng.bernoulli(0.5) ? rng.uniform(0.0, 0.45) : 0.0, all);
  RC_ASSERT(same.size() >= 2U);
  expect_same(same, other);
}

TEST(SensorTimeline, ScansThatAreLaterThanTheLagAreInTheMapAllTheSame) {
  Drive drive{.speed_mps = 1.0, .scan_hz = 10.0, .scan_phase_s = 0.013};
  std::vector<double> odometry;
  for (int i = 1; i < 6000; ++i) odometry.push_back(0.005 * i);
  const auto submaps = drive.submaps(odometry, 0.8);
  ASSERT_GE(submaps.size(), 3U);
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    EXPECT_GE(drive.scans_[i], submaps[i].keyframes.size() / 2) << i;
    ASSERT_NE(submaps[i].cloud, nullptr);
    // 5 m ahead of where the scan was taken, not of where it was heard.
    const double distance = submaps[i].keyframes.back().T_odom_body.translation.x() -
                            submaps[i].keyframes.front().T_odom_body.translation.x();
    for (const Eigen::Vector3f& p : submaps[i].cloud->points) {
      EXPECT_GT(p.x(), 5.0 - 1.0);
      EXPECT_LT(p.x(), 5.0 + distance + 1e-3);
    }
  }
}

TEST(SensorTimeline, KeyframesDoNotWaitForASensorThatIsSilent) {
  SubmapBuilder builder(RobotId{1}, {.has_scans = true});
  const auto cloud = std::make_shared<const PointCloud>(PointCloud{{{5.0F, 3.0F, 1.0F}}});
  std::vector<Timestamp> keyframes;
  for (int i = 0; i <= 2000; ++i) {  // 20 s, 1 m/s; no scan from 5 s to 15 s
    const double t = 0.01 * i;
    ASSERT_TRUE(
        builder.add(OdometrySample{at(t), {Eigen::Quaterniond::Identity(), {t, 0, 0}}, 1e-6 * Matrix6d::Identity()}));
    if (i % 10 == 3 && (t < 5.0 || t > 15.0) && i > 3) {
      ASSERT_TRUE(builder.add(Scan{at(t - 0.005), cloud, {}}));
    }
    if (i == 1490) {
      EXPECT_GT(builder.state().keyframes_without_scan, 20U);
    }
    for (const NewKeyframe& made : builder.take_keyframes()) keyframes.push_back(made.step.keyframe.stamp);
  }
  EXPECT_LT(builder.state().keyframes_without_scan, 3U);
  double longest_s = 0.0;
  for (std::size_t i = 1; i < keyframes.size(); ++i) longest_s = std::max(longest_s, keyframes[i] - keyframes[i - 1]);
  EXPECT_LE(longest_s, 0.3 + waiting::kSilent_s + 0.02);
  EXPECT_GT(longest_s, 1.0);
  EXPECT_GT(keyframes.size(), 50U);  // one per 0.3 or 0.4 m, but for the time of patience
}

TEST(SensorTimeline, ImagesAreAtKeyframesWhateverTheirStamps) {
  const Camera camera{.model = {CameraKind::pinhole, 752, 480, 400.0, 400.0, 376.0, 240.0, {}}, .T_body_camera = {}};
  const auto cameras = std::make_shared<const std::vector<Camera>>(1, camera);
  const auto cloud = std::make_shared<const PointCloud>(PointCloud{{{5.0F, 3.0F, 1.0F}}});
  SubmapBuilder builder(RobotId{1}, {.has_scans = true, .has_images = true});
  std::size_t taken = 0, scans = 0;
  const auto hear = [&](double t) {  // what sensors saw in the last 5 ms
    const auto is_time = [&](double period_s, double phase_s) {
      const double k = std::ceil((t - 0.005 - phase_s) / period_s + 1e-9);
      return phase_s + k * period_s <= t ? std::optional(phase_s + k * period_s) : std::nullopt;
    };
    if (const auto scan = is_time(0.1, 0.0321); scan && builder.wants_scan(at(*scan))) {
      ASSERT_TRUE(builder.add(Scan{at(*scan), cloud, {}}));
      ++scans;
    }
    const auto images = is_time(0.05, 0.0112);
    if (!images || !builder.wants_images(at(*images))) return;
    const TrackedImages seen{at(*images), cameras, {{0, {{{100.0F, 50.0F}, 0.8F, 0}}, {}}}, {}, {}};
    const auto ok = builder.add(seen);
    ASSERT_TRUE(ok.has_value()) << ok.error().message;
    ++taken;
    EXPECT_EQ(builder.state().images.back().stamp, builder.state().keyframes.back().stamp);
  };
  for (int i = 0; i <= 4000; ++i) {
    const double t = 0.005 * i;
    ASSERT_TRUE(
        builder.add(OdometrySample{at(t), {Eigen::Quaterniond::Identity(), {t, 0, 0}}, 1e-6 * Matrix6d::Identity()}));
    hear(t);
  }
  std::size_t keyframes = 0;
  for (const NewKeyframe& made : builder.take_keyframes()) keyframes += made.step.keyframe.index > 0;
  EXPECT_GE(keyframes, 55U);
  EXPECT_EQ(taken, keyframes);
  EXPECT_GE(scans, keyframes - 1);
  // Too late for its place.
  const TrackedImages late{at(18.0), cameras, {{0, {}, {}}}, {}, {}};
  EXPECT_FALSE(builder.add(late).has_value());
}

TEST(SensorTimeline, WhatWaitsIsSmallAtAThousandSamplesASecond) {
  SubmapBuilder builder(RobotId{1}, {.has_scans = true});
  std::size_t most = 0, history = 0;
  for (int i = 0; i < 5000; ++i) {
    const double t = 0.001 * i;
    ASSERT_TRUE(
        builder.add(OdometrySample{at(t), {Eigen::Quaterniond::Identity(), {t, 0, 0}}, 1e-9 * Matrix6d::Identity()}));
    most = std::max(most, builder.state().waiting.odometry.size());
    history = std::max(history, builder.state().recent.size());
  }
  // One each 3 ms.
  EXPECT_LE(static_cast<double>(most), 1.4 * waiting::kLate_s / SensorTimeline::kFinest_s);
  EXPECT_LE(static_cast<double>(history), 1.4 * SubmapBuilder::kHistory_s / SensorTimeline::kFinest_s);
  EXPECT_NEAR(builder.since_keyframe().covariance(3, 3),
              1e-9 * 1000 * (4.999 - (builder.state().keyframes.back().stamp - at(0))), 1e-11);
}

}  // namespace sensor_timeline_test
}  // namespace tutti::robot
