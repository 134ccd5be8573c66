// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/imu_preintegration.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <fstream>
#include <limits>
#include <sstream>

#include "support/estimation/bundle/scene.hpp"
#include "support/sanitized.hpp"
#include "support/shared_data.hpp"
#include "tutti/formats/trajectory_file.hpp"

namespace tutti::bundle {
namespace imu_preintegration_test {

using namespace test;

Keyframe keyframe(std::uint32_t index, double seconds) { return {.index = index, .stamp = Timestamp{} + seconds}; }

/// Irregular in time, violent.
std::vector<ImuSample> random_samples(Rng& rng, double seconds) {
  std::vector<ImuSample> out;
  for (double t = -0.02; t < seconds + 0.05; t += rng.uniform(0.003, 0.02))
    out.push_back({Timestamp{} + t, random_vector(rng, 1.0), random_vector(rng, 5.0)});
  return out;
}

Vector9d difference(const ImuPreintegration& a, const ImuPreintegration& b) {
  Vector9d out;
  out << so3_log(a.delta_rotation.conjugate() * b.delta_rotation), b.delta_velocity - a.delta_velocity,
      b.delta_position - a.delta_position;
  return out;
}

RC_GTEST_PROP(ImuPreintegration, BiasJacobiansAreTheDerivatives, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const auto samples = random_samples(rng, 0.5);
  const auto from = keyframe(3, 0.0), to = keyframe(4, 0.47);
  Vector6d bias = random_tangent(rng, 0.1);
  const auto at = [&](const Vector6d& b) {
    return estimation::preintegrate(samples, from, to, {b.head<3>(), b.tail<3>()}, {}).value();
  };
  constexpr double h = 1e-5;
  Eigen::Matrix<double, 9, 6> numeric;
  for (int i = 0; i < 6; ++i) {
    const Vector6d d = h * Vector6d::Unit(i);
    const auto middle = at(bias);
    numeric.col(i) = (difference(middle, at(bias + d)) - difference(middle, at(bias - d))) / (2.0 * h);
  }
  RC_ASSERT(matrix_near(at(bias).d_bias, numeric, 1e-6));
  RC_ASSERT(at(bias).from_keyframe == 3U);
}

RC_GTEST_PROP(ImuPreintegration, PartsMakeTheWhole, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const auto samples = random_samples(rng, 0.6);
  // Split at a sample: elsewhere the trapezoids differ.
  const auto a = keyframe(0, 0.0), c = keyframe(2, 0.6);
  const Keyframe b{.index = 1, .stamp = samples[samples.size() / 2].stamp};
  const auto whole = estimation::preintegrate(samples, a, c, {}, {}).value();
  const auto first = estimation::preintegrate(samples, a, b, {}, {}).value();
  const auto second = estimation::preintegrate(samples, b, c, {}, {}).value();
  const double t = second.duration_s;
  const Eigen::Vector3d position =
      first.delta_position + first.delta_velocity * t + first.delta_rotation * second.delta_position;
  const Eigen::Vector3d velocity = first.delta_velocity + first.delta_rotation * second.delta_velocity;
  RC_ASSERT(matrix_near(whole.delta_position, position, 1e-9));
  RC_ASSERT(matrix_near(whole.delta_velocity, velocity, 1e-9));
  RC_ASSERT(whole.delta_rotation.angularDistance(first.delta_rotation * second.delta_rotation) < 1e-7);
  RC_ASSERT(std::abs(whole.duration_s - first.duration_s - t) < 1e-9);
}

/// Follows the scene's motion, from exact samples.
TEST(ImuPreintegration, FollowsTheMotion) {
  std::vector<ImuSample> samples;
  for (int i = -2; i < 300; ++i) samples.push_back(scene_imu(i / 200.0, 20));
  const double from = 0.1234, to = 1.2377, t = to - from;
  const auto imu = estimation::preintegrate(samples, keyframe(0, from), keyframe(1, to), {}, {}).value();
  const Pose3 T_i = scene_pose(from, 20), T_j = scene_pose(to, 20);
  const auto velocity = [](double at) {
    return Eigen::Vector3d((scene_pose(at + 1e-4, 20).translation - scene_pose(at - 1e-4, 20).translation) / 2e-4);
  };
  const Eigen::Quaterniond R = T_i.rotation.conjugate();
  EXPECT_LT(imu.delta_rotation.angularDistance(R * T_j.rotation), 1e-5);
  EXPECT_TRUE(matrix_near(imu.delta_velocity, R * (velocity(to) - velocity(from) - kSceneGravity * t), 1e-4));
  EXPECT_TRUE(matrix_near(imu.delta_position,
                          R * (T_j.translation - T_i.translation - velocity(from) * t - 0.5 * kSceneGravity * t * t),
                          1e-4));
}

TEST(ImuPreintegration, CovarianceIsThatOfTheNoise) {
  TUTTI_STATISTIC();
  const ImuNoise noise{.gyro_noise_density = 1e-2, .accelerometer_noise_density = 5e-2};
  std::vector<ImuSample> exact;
  for (int i = 0; i <= 100; ++i) exact.push_back(scene_imu(i / 200.0, 6));
  const auto from = keyframe(0, 0.0), to = keyframe(1, 0.5);
  const auto truth = estimation::preintegrate(exact, from, to, {}, noise).value();
  const Eigen::LLT<Matrix9d> llt(truth.covariance);
  ASSERT_EQ(llt.info(), Eigen::Success);
  Rng rng(1);
  constexpr int kRuns = 400;
  double sum = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    auto samples = exact;
    for (auto& sample : samples) {
      sample.gyro += random_vector(rng, noise.gyro_noise_density * std::sqrt(200.0));
      sample.accelerometer += random_vector(rng, noise.accelerometer_noise_density * std::sqrt(200.0));
    }
    const Vector9d error = difference(truth, estimation::preintegrate(samples, from, to, {}, noise).value());
    sum += llt.matrixL().solve(error).squaredNorm();
  }
  EXPECT_NEAR(sum / kRuns, 9.0, 0.9);  // chi-square of nine, its mean's sigma is 0.21
}

TEST(ImuPreintegration, RefusesWhatDoesNotCoverTheTime) {
  std::vector<ImuSample> samples;
  for (int i = 0; i <= 100; ++i) samples.push_back({Timestamp{} + i * 0.005, {}, {}});
  const auto preintegrated = [&](double from, double to) {
    return estimation::preintegrate(samples, keyframe(0, from), keyframe(1, to), {}, {}).has_value();
  };
  EXPECT_TRUE(preintegrated(0.0, 0.5));
  EXPECT_FALSE(preintegrated(-0.1, 0.3));
  EXPECT_FALSE(preintegrated(0.3, 0.6));
  EXPECT_FALSE(preintegrated(0.3, 0.3));
  auto bad = samples;
  bad[50].gyro.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(estimation::preintegrate(bad, keyframe(0, 0.2), keyframe(1, 0.3), {}, {}));
  samples.erase(samples.begin() + 20, samples.begin() + 50);
  EXPECT_FALSE(preintegrated(0.0, 0.5));
  EXPECT_TRUE(preintegrated(0.0, 0.09));
}

TEST(GyroBias, IsFound) {
  const Eigen::Vector3d bias(-0.02, 0.03, 0.08);
  std::vector<ImuSample> samples;
  for (int i = -2; i < 1210; ++i) {
    samples.push_back(scene_imu(i / 200.0, 20));
    samples.back().gyro += bias;
  }
  std::vector<Keyframe> keyframes;
  for (std::uint32_t k = 0; k < 6; ++k)
    keyframes.push_back({.index = k, .stamp = Timestamp{} + 1.1 * k, .T_odom_body = scene_pose(1.1 * k, 20)});
  EXPECT_TRUE(matrix_near(estimation::estimate_gyro_bias(samples, keyframes).value(), bias, 1e-4));
  EXPECT_FALSE(estimation::estimate_gyro_bias(samples, std::span(keyframes).first(3)));
}

TEST(GyroBias, OfTheRecording) {
  TUTTI_REQUIRE_SHARED("data/euroc/V1_01/imu0.csv");
  std::vector<ImuSample> samples;
  std::ifstream file(shared_path("data/euroc/V1_01/imu0.csv"));
  std::string line;
  while (std::getline(file, line)) {
    if (line.starts_with('#')) continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    ImuSample s;
    std::istringstream(line) >> s.stamp.ns >> s.gyro.x() >> s.gyro.y() >> s.gyro.z() >> s.accelerometer.x() >>
        s.accelerometer.y() >> s.accelerometer.z();
    samples.push_back(s);
  }
  const auto odometry =
      formats::read_trajectory(shared_path("data/euroc/V1_01/rovioli_keyframes.tum").string()).value();
  std::vector<Keyframe> keyframes;
  for (const auto& pose : odometry) keyframes.push_back({.stamp = pose.stamp, .T_odom_body = pose.pose});
  const auto bias = estimation::estimate_gyro_bias(samples, keyframes).value();
  EXPECT_TRUE(matrix_near(bias, Eigen::Vector3d(-0.002, 0.021, 0.077), 0.003));  // EuRoC's own estimate, rounded
}

}  // namespace imu_preintegration_test
}  // namespace tutti::bundle
