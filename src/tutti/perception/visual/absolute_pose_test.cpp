// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/absolute_pose.hpp"

#include <gtest/gtest.h>

#include "support/perception/visual/textured_room.hpp"
#include "support/random_pose.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::visual {
namespace absolute_pose_test {

const auto kCameras = test::stereo_cameras();
const AbsolutePoseConfig kConfig;

struct Case {
  Pose3 T_map_body;
  std::vector<Sighting> sightings;
};

/// Points 1.5 to 5 m ahead, known to sigma_m along the axis of the first camera and to a tenth of that across it.
Case case_of(int n, double noise_px, double sigma_m, Rng& rng, std::uint32_t camera = 0) {
  Case out{.T_map_body = tutti::test::random_pose(rng, 3.0)};
  const Eigen::Matrix3d R_map_camera = (out.T_map_body * kCameras[camera].T_body_camera).rotation.toRotationMatrix();
  const Eigen::Vector3d sigma{0.1 * sigma_m, 0.1 * sigma_m, sigma_m};
  while (static_cast<int>(out.sightings.size()) < n) {
    const double z = rng.uniform(1.5, 5.0);
    const Eigen::Vector3d p_camera{rng.uniform(-0.6, 0.6) * z, rng.uniform(-0.4, 0.4) * z, z};
    const Eigen::Vector3d error = sigma.cwiseProduct(tutti::test::random_vector(rng));
    const auto pixel = project(kCameras[camera].model, p_camera + error);
    out.sightings.push_back({camera, *pixel + noise_px * Eigen::Vector2d(rng.normal(), rng.normal()),
                             std::max(0.05, noise_px), out.T_map_body * kCameras[camera].T_body_camera * p_camera,
                             R_map_camera * sigma.cwiseAbs2().asDiagonal() * R_map_camera.transpose()});
  }
  return out;
}

void add_outliers(int n, Case& out, Rng& rng) {
  for (int i = 0; i < n; ++i) {
    Sighting wrong = out.sightings[rng.index(out.sightings.size())];
    wrong.pixel = {rng.uniform(20.0, 730.0), rng.uniform(20.0, 460.0)};
    out.sightings.push_back(wrong);
  }
}

TEST(AbsolutePose, findsThePoseAmongTwiceAsManyOutliers) {
  Rng rng(1);
  for (int i = 0; i < 20; ++i) {
    Case c = case_of(30, 0.5, 0.0, rng);
    add_outliers(60, c, rng);
    const auto pose = absolute_pose(c.sightings, kCameras, kConfig, rng.fork(7));
    ASSERT_TRUE(pose.has_value());
    EXPECT_GE(pose->inliers.size(), 29U);
    EXPECT_LE(pose->inliers.size(), 32U);
    const Vector6d error = local(c.T_map_body, pose->T_map_body);
    EXPECT_LT(error.head<3>().norm(), 0.02);
    EXPECT_LT(error.tail<3>().norm(), 0.01);
  }
}

double mean_chi2(double noise_px, double sigma_m) {
  Rng rng(2);
  double sum = 0.0;
  const int n = 300;
  for (int i = 0; i < n; ++i) {
    const Case c = case_of(40, noise_px, sigma_m, rng);
    const auto pose = absolute_pose(c.sightings, kCameras, {.max_reprojection_px = 10.0}, rng.fork(7));
    EXPECT_TRUE(pose.has_value());
    if (!pose) return 0.0;
    const Vector6d error = local(c.T_map_body, pose->T_map_body);
    sum += squared_distance(error, pose->covariance);
  }
  return sum / n;
}

TEST(AbsolutePose, covarianceIsWhatTheErrorsAre) {  // 6, and what Cauchy's loss costs in accuracy
  for (const double chi2 : {mean_chi2(0.5, 0.0), mean_chi2(0.3, 0.1)}) {
    EXPECT_GT(chi2, 4.5);
    EXPECT_LT(chi2, 7.5);
  }
}

TEST(AbsolutePose, sightingsOfTheOtherCameraCount) {
  Rng rng(3);
  Case c = case_of(20, 0.3, 0.0, rng);
  const auto one = absolute_pose(c.sightings, kCameras, kConfig, rng.fork(7));
  Case other = case_of(20, 0.3, 0.0, rng, 1);
  for (Sighting& s : other.sightings) s.point = c.T_map_body * (other.T_map_body.inverse() * s.point);
  c.sightings.insert(c.sightings.end(), other.sightings.begin(), other.sightings.end());
  const auto both = absolute_pose(c.sightings, kCameras, kConfig, rng.fork(7));
  ASSERT_TRUE(one && both);
  EXPECT_EQ(both->inliers.size(), 40U);
  EXPECT_LT(both->covariance.trace(), 0.7 * one->covariance.trace());
  EXPECT_LT(local(c.T_map_body, both->T_map_body).norm(), 0.01);
}

TEST(AbsolutePose, nothingComesOfFewOrUnrelatedSightings) {
  Rng rng(4);
  Case c = case_of(3, 0.3, 0.0, rng);
  EXPECT_FALSE(absolute_pose(c.sightings, kCameras, kConfig, rng));
  EXPECT_FALSE(absolute_pose({}, kCameras, kConfig, rng));
  c = case_of(30, 0.3, 0.0, rng);
  for (Sighting& s : c.sightings) s.pixel = {rng.uniform(20.0, 730.0), rng.uniform(20.0, 460.0)};
  const auto pose = absolute_pose(c.sightings, kCameras, kConfig, rng.fork(7));
  EXPECT_TRUE(!pose || pose->inliers.size() < 8);
  for (Sighting& s : c.sightings) s.point = c.sightings[0].point;
  EXPECT_FALSE(absolute_pose(c.sightings, kCameras, kConfig, rng));
}

TEST(AbsolutePose, dependsOnTheSeedAlone) {
  Rng rng(5);
  Case c = case_of(20, 0.5, 0.0, rng);
  add_outliers(60, c, rng);
  const auto one = absolute_pose(c.sightings, kCameras, kConfig, Rng(9)),
             other = absolute_pose(c.sightings, kCameras, kConfig, Rng(9));
  ASSERT_TRUE(one && other);
  EXPECT_TRUE(one->T_map_body == other->T_map_body);
  EXPECT_EQ(one->inliers, other->inliers);
}

}  // namespace absolute_pose_test
}  // namespace tutti::visual
