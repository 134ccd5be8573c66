// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/imu_factor.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <functional>

#include "support/estimation/bundle/scene.hpp"

namespace tutti::bundle {
namespace imu_factor_test {

using namespace test;

struct State {
  Pose3 T_i, T_j;
  MotionState m_i, m_j;
  Eigen::Vector3d g;
};

Vector15d residual(const State& s, const ImuPreintegration& imu) {
  return linearise_imu(s.T_i, s.m_i, s.T_j, s.m_j, s.g, imu).residual;
}

Vector9d& as_vector(MotionState& motion, Vector9d& storage) {
  storage << motion.velocity, motion.gyro_bias, motion.accelerometer_bias;
  return storage;
}
MotionState moved(MotionState motion, const Vector9d& d) {
  Vector9d v;
  as_vector(motion, v) += d;
  return {v.head<3>(), v.segment<3>(3), v.tail<3>()};
}

template <int Columns>
Eigen::Matrix<double, 15, Columns> numeric(
    const std::function<Vector15d(const Eigen::Matrix<double, Columns, 1>&)>& of) {
  constexpr double h = 1e-6;
  Eigen::Matrix<double, 15, Columns> out;
  for (int i = 0; i < Columns; ++i) {
    const Eigen::Matrix<double, Columns, 1> d = h * Eigen::Matrix<double, Columns, 1>::Unit(i);
    out.col(i) = (of(d) - of(-d)) / (2.0 * h);
  }
  return out;
}

MotionState random_motion(Rng& rng) {
  return {random_vector(rng, 2.0), random_vector(rng, 0.1), random_vector(rng, 0.3)};
}

ImuPreintegration random_preintegration(Rng& rng) {
  std::vector<ImuSample> samples;
  for (int i = -2; i < 105; ++i)
    samples.push_back({Timestamp{} + i * 0.01, random_vector(rng, 0.7), random_vector(rng, 5.0)});
  return estimation::preintegrate(samples, {.index = 0, .stamp = Timestamp{}}, {.index = 1, .stamp = Timestamp{} + 1.0},
                                  {random_vector(rng, 0.1), random_vector(rng, 0.3)}, {})
      .value();
}

RC_GTEST_PROP(ImuFactor, JacobiansAreTheDerivatives, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const ImuPreintegration imu = random_preintegration(rng);
  State s{random_pose(rng, 3.0), {}, random_motion(rng), random_motion(rng), random_vector(rng, 6.0)};
  s.T_j = s.T_i * Pose3{imu.delta_rotation * random_rotation(rng, 1.0), random_vector(rng)};
  const auto at = linearise_imu(s.T_i, s.m_i, s.T_j, s.m_j, s.g, imu);
  constexpr double kTolerance = 1e-6;
  RC_ASSERT(matrix_near(at.J_pose_i, numeric<6>([&](const Vector6d& d) {
                          return residual({retract(s.T_i, d), s.T_j, s.m_i, s.m_j, s.g}, imu);
                        }),
                        kTolerance));
  RC_ASSERT(matrix_near(at.J_pose_j, numeric<6>([&](const Vector6d& d) {
                          return residual({s.T_i, retract(s.T_j, d), s.m_i, s.m_j, s.g}, imu);
                        }),
                        kTolerance));
  RC_ASSERT(matrix_near(at.J_motion_i, numeric<9>([&](const Vector9d& d) {
                          return residual({s.T_i, s.T_j, moved(s.m_i, d), s.m_j, s.g}, imu);
                        }),
                        kTolerance));
  RC_ASSERT(matrix_near(at.J_motion_j, numeric<9>([&](const Vector9d& d) {
                          return residual({s.T_i, s.T_j, s.m_i, moved(s.m_j, d), s.g}, imu);
                        }),
                        kTolerance));
  RC_ASSERT(matrix_near(at.J_gravity, numeric<3>([&](const Eigen::Vector3d& d) {
                          return residual({s.T_i, s.T_j, s.m_i, s.m_j, s.g + d}, imu);
                        }),
                        kTolerance));
}

RC_GTEST_PROP(ImuFactor, InformationIsFull, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  const ImuPreintegration imu = random_preintegration(rng);
  const Matrix15d W = imu_root_information(imu, 1e-4, 4e-3);
  Matrix15d covariance = Matrix15d::Zero();
  covariance.topLeftCorner<9, 9>() = imu.covariance;
  covariance.diagonal().segment<3>(9).setConstant(1e-8 * imu.duration_s);
  covariance.diagonal().tail<3>().setConstant(1.6e-5 * imu.duration_s);
  RC_ASSERT(matrix_near(W * covariance * W.transpose(), Matrix15d::Identity(), 1e-6));
  RC_ASSERT((imu.covariance.topRightCorner<6, 6>().array().abs() > 0.0).any());
}

/// No error where the motion is the one that the IMU felt; a bias that the linearisation did not know is corrected.
TEST(ImuFactor, IsZeroAtTheTruth) {
  const estimation::ImuBias bias{{0.002, -0.003, 0.004}, {0.02, 0.01, -0.03}};
  std::vector<ImuSample> samples;
  for (int i = -2; i < 300; ++i) {
    samples.push_back(scene_imu(i / 200.0, 20));
    samples.back().gyro += bias.gyro;
    samples.back().accelerometer += bias.accelerometer;
  }
  const Keyframe from{.index = 0, .stamp = Timestamp{} + 0.1}, to{.index = 1, .stamp = Timestamp{} + 1.2};
  const auto imu = estimation::preintegrate(samples, from, to, {}, {}).value();
  const auto motion = [&](double t) {
    return MotionState{(scene_pose(t + 1e-4, 20).translation - scene_pose(t - 1e-4, 20).translation) / 2e-4, bias.gyro,
                       bias.accelerometer};
  };
  const Vector15d r =
      residual({scene_pose(0.1, 20), scene_pose(1.2, 20), motion(0.1), motion(1.2), kSceneGravity}, imu);
  EXPECT_LT(r.cwiseAbs().maxCoeff(), 3e-4) << r.transpose();
}

}  // namespace imu_factor_test
}  // namespace tutti::bundle
