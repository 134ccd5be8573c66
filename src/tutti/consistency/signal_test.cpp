// SPDX-License-Identifier: BSD-3-Clause
// The errors that each signal can and cannot see: the claims of docs/math.md, one test each.
#include "tutti/consistency/signal.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numbers>

#include "support/consistency/runs.hpp"

namespace tutti::consistency {
namespace signal_test {

constexpr const char* kSignals[] = {"distance", "pose", "relative_motion"};

/// How much a signal changes at each node, metres.
Eigen::VectorXd change(const char* name, const std::vector<Pose3>& server, const std::vector<Pose3>& robot) {
  return (evaluate_signal(name, robot) - evaluate_signal(name, server)).rowwise().norm();
}
/// The robot's error at each node, metres and radians.
Eigen::VectorXd metres(const std::vector<Pose3>& server, const std::vector<Pose3>& robot) {
  return pose_difference(server, robot).leftCols<3>().rowwise().norm();
}
Eigen::VectorXd radians(const std::vector<Pose3>& server, const std::vector<Pose3>& robot) {
  return pose_difference(server, robot).rightCols<3>().rowwise().norm();
}

/// From node `from` on, turned about node 0.
std::vector<Pose3> spun(std::vector<Pose3> poses, std::size_t from, double angle_rad) {
  const Pose3 turn =
      poses[0] * Pose3{so3_exp(Eigen::Vector3d(0, 0, angle_rad)), Eigen::Vector3d::Zero()} * poses[0].inverse();
  for (std::size_t n = from; n < poses.size(); ++n) poses[n] = turn * poses[n];
  return poses;
}

/// From node `from` on, moved.
std::vector<Pose3> shifted(std::vector<Pose3> poses, std::size_t from, const Eigen::Vector3d& by) {
  for (std::size_t n = from; n < poses.size(); ++n) poses[n].translation += by;
  return poses;
}

/// Every node moved and turned, by its own random error of size `scale`.
std::vector<Pose3> disturbed(std::vector<Pose3> poses, double scale, std::uint64_t seed) {
  Rng rng(seed);
  for (Pose3& T : poses) {
    Vector6d xi;
    for (double& x : xi) x = rng.normal(scale);
    T = retract(T, xi);
  }
  return poses;
}

TEST(Signal, ShapesOfNothingAndOne) {
  const std::vector<Pose3> one{test::corridor(1)};
  for (const char* name : kSignals) {
    EXPECT_EQ(evaluate_signal(name, {}).rows(), 0);
    EXPECT_EQ(evaluate_signal(name, one).rows(), 1);
    EXPECT_TRUE(evaluate_signal(name, one).isZero());
  }
  EXPECT_EQ(pose_difference({}, {}).rows(), 0);
  EXPECT_TRUE(pose_difference(one, one).isZero());
  EXPECT_THROW(evaluate_signal("loudness", one), std::logic_error);
}

TEST(Signal, DistanceIsThePapers) {
  const std::vector<Pose3> poses{test::at(1, 2, 3), test::at(4, 6, 3), test::at(1, 2, 5)};
  EXPECT_TRUE(evaluate_signal("distance", poses).isApprox(Eigen::Vector3d(0, 5, 2)));
}

RC_GTEST_PROP(Signal, NoneDependsOnTheFrame, (std::uint64_t seed)) {
  Rng rng(seed);
  const auto poses = test::corridor(80);
  const auto elsewhere = test::moved(test::random_pose(rng, 50.0), poses);
  for (const char* name : kSignals) RC_ASSERT(change(name, poses, elsewhere).maxCoeff() < 1e-10);
}

RC_GTEST_PROP(PoseDifference, IsUnchangedWhenTheRobotsFrameIsMoved, (std::uint64_t seed)) {
  Rng rng(seed);
  const auto server = test::corridor(80);
  const auto robot = disturbed(server, 0.1, seed);
  const auto elsewhere = test::moved(test::random_pose(rng, 50.0), robot);
  const Eigen::MatrixXd f = pose_difference(server, robot);
  RC_ASSERT(f.norm() > 0.1);
  RC_ASSERT((f - pose_difference(server, elsewhere)).cwiseAbs().maxCoeff() < 1e-9);
}

// The axes are those of the server's world: turning that turns the field along, and segments nothing.
RC_GTEST_PROP(PoseDifference, TurnsWithTheServersFrame, (std::uint64_t seed)) {
  Rng rng(seed);
  const auto server = test::corridor(80);
  const auto robot = disturbed(server, 0.01, seed);
  const Pose3 T = test::random_pose(rng, 50.0);
  const Eigen::MatrixXd f = pose_difference(server, robot), g = pose_difference(test::moved(T, server), robot);
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  RC_ASSERT((f.leftCols<3>() * R.transpose() - g.leftCols<3>()).cwiseAbs().maxCoeff() < 1e-9);
  RC_ASSERT((f.rightCols<3>() * R.transpose() - g.rightCols<3>()).cwiseAbs().maxCoeff() < 1e-9);
}

// Half the error, half the field; what is left over shrinks with the square.
RC_GTEST_PROP(PoseDifference, IsLinearForSmallErrors, (std::uint64_t seed)) {
  const auto server = test::corridor(80);
  const auto curvature = [&](double scale) {
    const Eigen::MatrixXd full = pose_difference(server, disturbed(server, scale, seed)),
                          half = pose_difference(server, disturbed(server, 0.5 * scale, seed));
    return (full - 2.0 * half).norm() / full.norm();
  };
  RC_ASSERT(curvature(1e-3) < 1e-2);
  RC_ASSERT(curvature(1e-4) < 0.2 * curvature(1e-3));
}

// Errors in rotation alone and in position alone, in units that differ by a thousand: each shows only in its columns.
TEST(PoseDifference, NeverMixesMetresAndRadians) {
  const auto server = test::corridor(80);
  auto turned = server, scaled = server;
  for (std::size_t n = 0; n < server.size(); ++n) {
    turned[n].rotation =
        turned[n].rotation * so3_exp(Eigen::Vector3d(0.01 * std::sin(0.3 * static_cast<double>(n)), 0, 0));
    scaled[n].translation *= 1000.0;  // the same run in millimetres
  }
  EXPECT_LT(metres(server, turned).maxCoeff(), 1e-12);
  EXPECT_GT(radians(server, turned).maxCoeff(), 5e-3);
  auto robot = disturbed(server, 0.01, 1), robot_scaled = robot;
  for (Pose3& T : robot_scaled) T.translation *= 1000.0;
  EXPECT_LT((metres(scaled, robot_scaled) - 1000.0 * metres(server, robot)).cwiseAbs().maxCoeff(), 1e-8);
}

// Half of the run turned by 20 degrees about node 0.
class Spin : public testing::Test {
 protected:
  static constexpr Eigen::Index kFrom = 35;
  std::vector<Pose3> poses_ = test::corridor(70);
  std::vector<Pose3> spun_ = spun(poses_, kFrom, 20.0 * kRadPerDeg);
};

TEST_F(Spin, IsOffByMetresAndDistanceIsBlindToIt) {
  double sum = 0.0;
  for (std::size_t n = kFrom; n < 70; ++n) sum += (spun_[n].translation - poses_[n].translation).norm();
  EXPECT_GT(sum / (70 - kFrom), 11.8);
  EXPECT_LT(change("distance", poses_, spun_).maxCoeff(), 1e-12);
}

TEST_F(Spin, PoseSeesItInMetresAndRadiansAlongTheRun) {
  EXPECT_GT(metres(poses_, spun_).mean(), 1.0);
  const Eigen::VectorXd turn = radians(poses_, spun_);  // less the mean: half before, half behind
  EXPECT_NEAR(turn(0), 10.0 * kRadPerDeg, 1e-4);
  EXPECT_NEAR(turn(69), 10.0 * kRadPerDeg, 1e-4);
}

TEST_F(Spin, RelativeMotionSeesItAtTheVeryNodeAndNowhereElse) {
  const Eigen::VectorXd seen = change("relative_motion", poses_, spun_);
  EXPECT_LT(seen.head(kFrom).maxCoeff(), 1e-12);
  EXPECT_LT(seen.tail(69 - kFrom).maxCoeff(), 1e-12);
  const double jump = (spun_[kFrom].translation - poses_[kFrom].translation).norm();
  EXPECT_NEAR(seen(kFrom), jump, 1e-9);
}

// 3 m of height from 50 m on: across the line of sight from node 0, so its distance grows by h^2 / (2 d) only.
class Height : public testing::Test {
 protected:
  static constexpr Eigen::Index kFrom = 50;
  static std::vector<Pose3> straight() {
    std::vector<Pose3> out;
    for (int n = 0; n < 100; ++n) out.push_back(test::at(n, 0, 0));
    return out;
  }
  std::vector<Pose3> poses_ = straight();
  std::vector<Pose3> raised_ = shifted(poses_, kFrom, {0, 0, 3});
};

TEST_F(Height, DistanceIsNearlyBlindToIt) { EXPECT_LT(change("distance", poses_, raised_).maxCoeff(), 0.03 * 3.0); }

TEST_F(Height, PoseSeesIt) {
  // The best line through a step of 3 m leaves up to half of it.
  EXPECT_GT(metres(poses_, raised_).maxCoeff(), 1.0);
}

TEST_F(Height, RelativeMotionSeesItAtTheVeryNodeAndNowhereElse) {
  const Eigen::VectorXd seen = change("relative_motion", poses_, raised_);
  EXPECT_NEAR(seen(kFrom), 3.0, 1e-12);
  EXPECT_LT(seen.head(kFrom).maxCoeff(), 1e-12);
  EXPECT_LT(seen.tail(99 - kFrom).maxCoeff(), 1e-12);
}

// A millimetre sideways a metre, ever faster, under millimetres of noise: metres off in the end, nowhere to be seen.
TEST(SlowDrift, IsPlainInThePoseAndFaintInRelativeMotion) {
  const auto poses = test::corridor(400);
  auto drifting = disturbed(poses, 0.005, 3), noisy = drifting;
  for (std::size_t n = 0; n < poses.size(); ++n)
    drifting[n].translation.z() += 1e-5 * static_cast<double>(n) * static_cast<double>(n);  // 1.6 m, steps < 8 mm
  EXPECT_GT(metres(poses, drifting).norm(), 10.0 * metres(poses, noisy).norm());
  EXPECT_LT(change("relative_motion", poses, drifting).norm(), 1.5 * change("relative_motion", poses, noisy).norm());
}

}  // namespace signal_test
}  // namespace tutti::consistency
