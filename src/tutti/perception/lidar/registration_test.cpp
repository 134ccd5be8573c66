// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/registration.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "support/perception/lidar/rooms.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/perception/lidar/submap_features.hpp"

namespace tutti::lidar {
namespace registration_test {

using namespace test;

OrientedCloud observe_oriented(const World& world, const Walk& walk, std::uint64_t seed) {
  return extract_features(make_submap({RobotId{0}, 0}, world, walk, Rng(seed)), {}).cloud;
}

Vector6d offset(Rng& rng, double metres, double radians) {
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = rng.normal();
  xi.head<3>() *= metres / xi.head<3>().norm();
  xi.tail<3>() *= radians / xi.tail<3>().norm();
  return xi;
}

TEST(RegisterClouds, recoversTheTransformFromOneMetreAndEightDegrees) {
  const Walk walk_a, walk_b{.from = {7, 4, 1.5}, .to = {9, 4, 1.5}, .yaw_rad = 0.6};
  const auto a = observe_oriented(furnished_room(), walk_a, 1), b = observe_oriented(furnished_room(), walk_b, 2);
  const Pose3 truth = true_relative(walk_a, walk_b);
  Rng rng(3);
  for (int trial = 0; trial < 10; ++trial) {
    const auto result = register_clouds(a, b, retract(truth, offset(rng, 1.0, 0.14)), {});
    const Vector6d error = local(truth, result.T_target_source);
    EXPECT_TRUE(result.converged);
    EXPECT_LT(error.head<3>().norm(), 0.02);
    EXPECT_LT(error.tail<3>().norm(), 0.003);
    EXPECT_GT(result.overlap, 0.8);
    EXPECT_LT(result.plane_rmse_m, 0.06);
    EXPECT_GT(result.min_translation_eigenvalue, 0.1);
  }
}

TEST(RegisterClouds, misfitIsAboutOneAtTheTruthAndLargeOff) {
  const Walk walk_a, walk_b{.from = {7, 4, 1.5}, .to = {9, 4, 1.5}, .yaw_rad = 0.6};
  const auto a = observe_oriented(furnished_room(), walk_a, 1), b = observe_oriented(furnished_room(), walk_b, 2);
  const Pose3 truth = true_relative(walk_a, walk_b);
  const auto right = register_clouds(a, b, truth, {});
  EXPECT_GT(right.misfit, 0.5);
  EXPECT_LT(right.misfit, 1.3);
  RegistrationConfig fixed;  // where it stands: one step that cannot go far
  fixed.levels = {{0.01, 4000, 1}};
  Vector6d off = Vector6d::Zero();
  off[1] = 0.15;
  EXPECT_GT(register_clouds(a, b, retract(truth, off), fixed).misfit, 2.0);
  auto unknown = a;
  unknown.roughness = nullptr;
  EXPECT_EQ(register_clouds(unknown, b, truth, {}).misfit, 0.0);
}

TEST(SelfResiduals, areTheNoiseOfAFlatWall) {
  const Walk walk;
  const auto cloud = observe_oriented(furnished_room(), walk, 1);
  double sum = 0.0, count = 0.0;
  for (const float residual : self_residuals(cloud, {}))
    if (!std::isnan(residual)) sum += residual * residual, count += 1.0;
  EXPECT_GT(count, 0.5 * static_cast<double>(cloud.size()));
  // Voxels average a few points of 2 cm noise; corners and the normals' errors add.
  EXPECT_GT(std::sqrt(sum / count), 0.005);
  EXPECT_LT(std::sqrt(sum / count), 0.05);
}

/// Mean squared error in units of the stated covariance, over degrees of freedom: 1 when the covariance is exact.
class ErrorOverCovariance {
 public:
  void add(const Vector6d& error, const Matrix6d& covariance) {
    sum_ += squared_distance(error, covariance);
    dof_ += 6;
  }
  /// The chance that a true ratio of `expected` shows outside of this is 2 in 10,000 (chi-square, Wilson-Hilferty).
  void expect(double expected) const {
    const double spread = 2.0 / (9.0 * dof_);
    const auto quantile = [&](double z) { return std::pow(1.0 - spread + z * std::sqrt(spread), 3); };
    EXPECT_GT(sum_ / dof_, expected * quantile(-3.72));
    EXPECT_LT(sum_ / dof_, expected * quantile(3.72));
  }

 private:
  double sum_ = 0.0;
  int dof_ = 0;
};

TEST(RegisterClouds, corridorIsFreeToSlide) {
  const Walk walk_a{.from = {30, 1.3, 1.2}, .to = {34, 1.3, 1.2}}, walk_b{.from = {33, 1.3, 1.2}, .to = {37, 1.3, 1.2}};
  const auto a = observe_oriented(corridor(), walk_a, 1), b = observe_oriented(corridor(), walk_b, 2);
  const auto result = register_clouds(a, b, true_relative(walk_a, walk_b), {});
  EXPECT_GT(result.overlap, 0.5);
  EXPECT_LT(result.min_translation_eigenvalue, 0.02);
  EXPECT_GT(result.covariance(0, 0), 100.0 * result.covariance(1, 1));  // along the corridor, across it
}

TEST(RegisterClouds, farApartOrEmptyDoesNotConverge) {
  const auto a = observe_oriented(furnished_room(), {}, 1);
  const auto far = register_clouds(a, a, {Eigen::Quaterniond::Identity(), {100, 0, 0}}, {});
  EXPECT_FALSE(far.converged);
  EXPECT_EQ(far.overlap, 0.0);
  EXPECT_FALSE(register_clouds({}, a, {}, {}).converged);
  EXPECT_FALSE(register_clouds(a, {}, {}, {}).converged);
}

TEST(RegisterClouds, aCloudOnItselfStaysWhereItIs) {
  const auto a = observe_oriented(furnished_room(), {}, 1);
  const auto result = register_clouds(a, a, {}, {});
  EXPECT_TRUE(result.converged);
  EXPECT_DOUBLE_EQ(result.overlap, 1.0);
  EXPECT_LT(local({}, result.T_target_source).norm(), 1e-6);
}

}  // namespace registration_test
}  // namespace tutti::lidar
