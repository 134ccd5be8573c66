// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/submap_builder.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "tutti/base/random.hpp"
#include "tutti/model/path_length.hpp"

namespace tutti::robot {
namespace submap_builder_test {

const Matrix6d kStepCovariance = Matrix6d::Identity() * 1e-4;

Timestamp at(double seconds) { return Timestamp{1'700'000'000'000'000'000LL} + seconds; }
Pose3 ahead(double metres) { return {Eigen::Quaterniond::Identity(), {metres, 0.0, 0.0}}; }

/// Straight ahead at 0.5 m/s for `seconds`, ten samples a second.
std::vector<Submap> drive(SubmapBuilder& builder, double seconds, bool with_scans = false) {
  std::vector<Submap> out;
  auto cloud = std::make_shared<PointCloud>();
  for (int i = 0; i < 50; ++i) cloud->points.emplace_back(5.0F, 0.5F * static_cast<float>(i), 1.0F);
  for (int i = 0; i <= static_cast<int>(std::lround(seconds * 10)); ++i) {
    const double t = 0.1 * i;
    EXPECT_TRUE(builder.add(OdometrySample{at(t), ahead(0.5 * t), kStepCovariance}).has_value());
    if (with_scans) {
      EXPECT_TRUE(builder.add(Scan{at(t), cloud}).has_value());
    }
  }
  builder.finish();
  while (auto submap = builder.take_submap()) out.push_back(std::move(*submap));
  return out;
}

TEST(SubmapBuilder, SubmapsOverlapByOneKeyframe) {
  SubmapBuilder builder(RobotId{3}, {});
  const std::vector<Submap> submaps = drive(builder, 34.0);
  ASSERT_EQ(submaps.size(), 4U);  // three of 10 s and the rest
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    EXPECT_EQ(submaps[i].id, (SubmapId{RobotId{3}, static_cast<std::uint32_t>(i)}));
    ASSERT_EQ(submaps[i].odometry.size() + 1, submaps[i].keyframes.size());
    if (i > 0) {
      EXPECT_EQ(submaps[i].keyframes.front(), submaps[i - 1].keyframes.back());
    }
    if (i < 3) {
      EXPECT_NEAR(submaps[i].keyframes.back().stamp - submaps[i].keyframes.front().stamp, 10.0, 1.0);
    }
  }
}

TEST(SubmapBuilder, OdometryFactorsAreTheRawMotionWithItsCompoundedCovariance) {
  SubmapBuilder builder(RobotId{0}, {.keyframe_distance_m = 0.5, .keyframe_time_s = 100.0});
  const std::vector<Submap> submaps = drive(builder, 12.0);
  ASSERT_FALSE(submaps.empty());
  for (const Submap& submap : submaps)
    for (std::size_t k = 0; k < submap.odometry.size(); ++k) {
      const Pose3 step = submap.keyframes[k].T_odom_body.inverse() * submap.keyframes[k + 1].T_odom_body;
      EXPECT_LT(local(step, submap.odometry[k].T_a_b).norm(), 1e-9);
      // Ten steps of 5 cm: rotations add up, translations get the levers' share on top.
      EXPECT_NEAR(submap.odometry[k].covariance(5, 5), 10 * 1e-4, 1e-9);
      EXPECT_GT(submap.odometry[k].covariance(1, 1), 10 * 1e-4);
    }
}

TEST(SubmapBuilder, RepresentativeKeyframesComeAboutEveryMetre) {
  SubmapBuilder builder(RobotId{0}, {});
  std::vector<double> positions;
  for (const Submap& submap : drive(builder, 60.0))
    for (std::size_t k = submap.id.index == 0 ? 0 : 1; k < submap.keyframes.size(); ++k)
      if (submap.keyframes[k].representative) positions.push_back(submap.keyframes[k].T_odom_body.translation.x());
  ASSERT_GT(positions.size(), 20U);  // 30 m
  EXPECT_EQ(positions.front(), 0.0);
  for (std::size_t i = 1; i < positions.size(); ++i) EXPECT_NEAR(positions[i] - positions[i - 1], 1.2, 0.25);
}

/// Straight ahead for 60 s, 200 samples a second that are off by a centimetre each.
std::vector<Submap> travel(double speed_mps, const SubmapConfig& config) {
  SubmapBuilder builder(RobotId{0}, config);
  Rng rng(1);
  for (int i = 0; i <= 12'000; ++i) {
    const double t = 0.005 * i;
    EXPECT_TRUE(builder.add(OdometrySample{at(t), ahead(speed_mps * t + rng.normal(0.01)), kStepCovariance}));
  }
  std::vector<Submap> out;
  while (auto submap = builder.take_submap()) out.push_back(std::move(*submap));
  return out;
}

// 10 s by car are 70 m, over which odometry bends.
TEST(SubmapBuilder, ByCarTheDistanceEndsASubmap) {
  const std::vector<Submap> submaps = travel(7.0, {});
  EXPECT_NEAR(static_cast<double>(submaps.size()), 60.0 * 7.0 / 20.0, 1.0);
  for (const Submap& submap : submaps) {
    EXPECT_GE(path_length_m(submap.odometry), 20.0);
    EXPECT_LT(path_length_m(submap.odometry), 20.5);  // at the keyframe after 20 m
  }
}

TEST(SubmapBuilder, OnFootOnlyTimeEndsASubmap) {
  const std::vector<Submap> submaps = travel(1.4, {}), by_time = travel(1.4, {.distance_m = 1e9});
  ASSERT_EQ(submaps.size(), by_time.size());
  EXPECT_GE(submaps.size(), 5U);
  for (std::size_t i = 0; i < submaps.size(); ++i) EXPECT_EQ(submaps[i].keyframes, by_time[i].keyframes);
}

// A point that is changed after its submap has ended, and before it is taken, is changed in the cloud.
TEST(SubmapBuilder, MergingScansIsLeftToWhoTakesTheSubmap) {
  SubmapBuilder builder(RobotId{0}, {});
  const auto cloud = std::make_shared<PointCloud>(PointCloud{{{5.0F, 0.0F, 1.0F}}});
  for (int i = 0; i <= 45; ++i) {
    ASSERT_TRUE(builder.add(OdometrySample{at(0.5 * i), ahead(0.0), kStepCovariance}));
    ASSERT_TRUE(builder.add(Scan{at(0.5 * i), cloud}));
  }
  cloud->points[0].y() = 2.0F;
  for (std::uint32_t i = 0; i < 2; ++i) {
    const auto submap = builder.take_submap();
    ASSERT_TRUE(submap && submap->cloud);
    EXPECT_EQ(submap->id.index, i);
    EXPECT_EQ(submap->cloud->points, cloud->points);
  }
  EXPECT_FALSE(builder.take_submap().has_value());
}

TEST(SubmapBuilder, CloudIsInTheSubmapFrame) {
  SubmapBuilder builder(RobotId{0}, {});
  const std::vector<Submap> submaps = drive(builder, 20.0, true);
  ASSERT_EQ(submaps.size(), 2U);
  for (const Submap& submap : submaps) {
    ASSERT_TRUE(submap.cloud);
    float low = 1e9F;
    float high = -1e9F;
    for (const Eigen::Vector3f& p : submap.cloud->points) {
      low = std::min(low, p.x());
      high = std::max(high, p.x());
    }
    EXPECT_NEAR(low, 5.0F, 0.2F);          // from the first keyframe
    EXPECT_NEAR(high, 5.0F + 5.0F, 0.5F);  // and on, 5 m later, to a voxel
  }
}

TEST(SubmapBuilder, SweepsAreUndistortedByTheOwnOdometry) {
  SubmapBuilder builder(RobotId{0}, {});
  constexpr double kSpeed = 2.0, kWall = 5.0;  // a wall ahead of the start
  for (int i = 0; i <= 90; ++i) {
    const double t = 0.125 * i;
    ASSERT_TRUE(builder.add(OdometrySample{at(t), ahead(kSpeed * t), kStepCovariance}).has_value());
    if (!builder.wants_scan() || t < 0.25) continue;
    auto cloud = std::make_shared<PointCloud>();
    auto ages = std::make_shared<std::vector<float>>();
    for (int k = 0; k < 50; ++k) {
      ages->push_back(0.004F * static_cast<float>(k));
      const double then = t - static_cast<double>(ages->back());
      cloud->points.emplace_back(static_cast<float>(kWall - kSpeed * then), 0.5F * static_cast<float>(k), 1.0F);
    }
    ASSERT_TRUE(builder.add(Scan{at(t), cloud, ages}).has_value());
  }
  const auto submap = builder.take_submap();
  ASSERT_TRUE(submap && submap->cloud);
  ASSERT_FALSE(submap->cloud->points.empty());
  for (const Eigen::Vector3f& p : submap->cloud->points) EXPECT_NEAR(p.x(), kWall, 1e-3F);
}

TEST(SubmapBuilder, WantsScansAtKeyframesOnly) {
  SubmapBuilder builder(RobotId{0}, {.keyframe_distance_m = 0.3, .keyframe_time_s = 100.0});
  EXPECT_FALSE(builder.wants_scan());
  for (int i = 0; i <= 60; ++i) {
    ASSERT_TRUE(builder.add(OdometrySample{at(0.1 * i), ahead(0.05 * i), kStepCovariance}));
    EXPECT_EQ(builder.wants_scan(), !builder.take_keyframes().empty());
  }
}

TEST(SubmapBuilder, ASweepOlderThanTheKnownOdometryIsRefused) {
  SubmapBuilder builder(RobotId{0}, {});
  const auto cloud = std::make_shared<const PointCloud>(PointCloud{{{5.0F, 0.0F, 0.0F}}});
  const auto message = [&](double t, float age) {
    const auto ok = builder.add(Scan{at(t), cloud, std::make_shared<const std::vector<float>>(1, age)});
    return ok.has_value() ? std::string() : ok.error().message;
  };
  ASSERT_TRUE(builder.add(OdometrySample{at(0), ahead(0), kStepCovariance}).has_value());
  EXPECT_NE(message(0, 0.1F).find("0.1 s old"), std::string::npos);
  for (int i = 1; i <= 80; ++i)
    ASSERT_TRUE(builder.add(OdometrySample{at(0.125 * i), ahead(0), kStepCovariance}).has_value());
  EXPECT_NE(message(10, 2.0F).find("2 s old"), std::string::npos);
  EXPECT_EQ(message(10, static_cast<float>(SubmapBuilder::kSweepHistoryS)), "");
}

TEST(SubmapBuilder, BadInputIsRefusedAndChangesNothing) {
  SubmapBuilder builder(RobotId{0}, {});
  const auto message = [](const auto& result) { return result.has_value() ? std::string() : result.error().message; };
  EXPECT_NE(message(builder.add(Scan{at(0), nullptr})).find("no odometry"), std::string::npos);
  ASSERT_TRUE(builder.add(OdometrySample{at(0), ahead(0), kStepCovariance}).has_value());
  EXPECT_NE(message(builder.add(OdometrySample{at(0), ahead(1), kStepCovariance})).find("does not follow"),
            std::string::npos);
  EXPECT_NE(message(builder.add(OdometrySample{at(-1), ahead(1), kStepCovariance})).find("does not follow"),
            std::string::npos);
  Pose3 nan = ahead(1);
  nan.translation.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(builder.add(OdometrySample{at(1), nan, kStepCovariance}).has_value());
  Pose3 long_quaternion = ahead(1);
  long_quaternion.rotation.coeffs() *= 1.1;
  EXPECT_NE(message(builder.add(OdometrySample{at(1), long_quaternion, kStepCovariance})).find("1.1"),
            std::string::npos);
  EXPECT_NE(message(builder.add(OdometrySample{at(1), ahead(1), -kStepCovariance})).find("negative variance"),
            std::string::npos);
  EXPECT_NE(message(builder.add(Scan{at(0), std::make_shared<PointCloud>()})).find("empty"), std::string::npos);
  EXPECT_NE(message(builder.add(Scan{at(5), std::make_shared<PointCloud>()})).find("no odometry"), std::string::npos);
  ASSERT_TRUE(builder.add(OdometrySample{at(1), ahead(1), kStepCovariance}).has_value());
  builder.finish();
  const auto last = builder.take_submap();
  ASSERT_TRUE(last.has_value());
  EXPECT_EQ(last->keyframes.size(), 2U);
  builder.finish();  // nothing since
  EXPECT_FALSE(builder.take_submap().has_value());
}

/// A wall of points 3 m to the left of the trajectory, seen by a camera that looks there.
TrackedImages images_at(Timestamp stamp, double distance_m, bool swapped = false) {
  const Eigen::Quaterniond left(Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
  const Camera camera{.model = {CameraKind::pinhole, 752, 480, 400.0, 400.0, 376.0, 240.0, {}},
                      .T_body_camera = {left, Eigen::Vector3d::Zero()}};
  TrackedImage image;
  for (std::uint64_t track = 1; track <= 200; ++track) {
    const Eigen::Vector3d point(0.15 * static_cast<double>(track) - 2.0, 3.0 + 0.1 * static_cast<double>(track % 7),
                                0.2 * static_cast<double>(track % 5) - 0.4);
    const auto pixel = project(camera.model, camera.T_body_camera.inverse() * (ahead(distance_m).inverse() * point));
    if (!pixel || !in_image(camera.model, *pixel)) continue;
    const Eigen::Vector2d seen = swapped ? Eigen::Vector2d(pixel->y(), pixel->x()) : *pixel;
    image.keypoints.push_back({seen.cast<float>(), 0.5F, track});
  }
  TrackedImages out{stamp, std::make_shared<const std::vector<Camera>>(1, camera), {image}, {}, {}};
  for (int i = -201; i <= 0; ++i)  // at constant speed the IMU measures gravity alone
    out.imu.push_back({stamp + 0.005 * i, {0.0, 0.0, 0.02}, {0.0, 0.0, 9.81}});
  return out;
}

/// As drive(), with images at keyframes; submaps are taken as soon as they can be.
std::vector<Submap> look_around(SubmapBuilder& builder, double seconds, bool swapped = false) {
  std::vector<Submap> out;
  const auto take = [&] {
    while (auto submap = builder.take_submap()) out.push_back(std::move(*submap));
  };
  for (int i = 0; i <= static_cast<int>(std::lround(seconds * 10)); ++i) {
    const double t = 0.1 * i;
    EXPECT_TRUE(builder.add(OdometrySample{at(t), ahead(0.5 * t), kStepCovariance}).has_value());
    take();
    if (builder.wants_scan()) {
      EXPECT_TRUE(builder.add(images_at(at(t), 0.5 * t, swapped && i % 2 == 0)).has_value());
      take();
    }
  }
  builder.finish();
  take();
  return out;
}

TEST(SubmapBuilder, WhatTheImuMeasuredStaysAtHomeUnlessItIsAskedFor) {
  SubmapBuilder builder(RobotId{3}, {});
  for (const Submap& submap : look_around(builder, 34.0)) {
    ASSERT_NE(submap.visual, nullptr);
    EXPECT_TRUE(submap.visual->imu.empty());
  }
}

TEST(SubmapBuilder, TheSharedKeyframesImagesAreInBothSubmaps) {
  SubmapBuilder builder(RobotId{3}, {.visual = {.send_imu = true}});
  const std::vector<Submap> submaps = look_around(builder, 34.0);
  ASSERT_EQ(submaps.size(), 4U);
  for (std::size_t i = 0; i < submaps.size(); ++i) {
    ASSERT_NE(submaps[i].visual, nullptr);
    const VisualPayload& seen = *submaps[i].visual;
    ASSERT_EQ(seen.frames.size(), submaps[i].keyframes.size());
    EXPECT_GT(seen.landmarks.size(), 30U);
    EXPECT_EQ(seen.frames.front().keyframe, submaps[i].keyframes.front().index);
    EXPECT_EQ(seen.frames.back().keyframe, submaps[i].keyframes.back().index);
    ASSERT_EQ(seen.imu.size(), submaps[i].odometry.size());
    for (const ImuPreintegration& step : seen.imu) {
      EXPECT_NEAR(step.gyro_bias.z(), 0.02, 1e-6);  // the odometry does not turn
      EXPECT_NEAR(step.delta_velocity.z(), 9.81 * step.duration_s, 1e-6);
    }
    // In the submap's frame, the body of its first keyframe: on the wall.
    for (const Landmark& landmark : seen.landmarks) {
      EXPECT_GT(landmark.position.y(), 2.9F);
      EXPECT_LT(landmark.position.y(), 3.7F);
    }
  }
  EXPECT_TRUE(builder.take_image_errors().empty());
}

TEST(SubmapBuilder, ImagesThatContradictTheOdometryAreLeftOutAndReported) {
  SubmapBuilder builder(RobotId{3}, {});
  const std::vector<Submap> submaps = look_around(builder, 12.0, true);
  ASSERT_EQ(submaps.size(), 2U);
  EXPECT_EQ(submaps[0].visual, nullptr);
  EXPECT_FALSE(submaps[0].keyframes.empty());
  const auto errors = builder.take_image_errors();
  ASSERT_FALSE(errors.empty());
  EXPECT_NE(errors[0].message.find("images of submap 3/0"), std::string::npos) << errors[0].message;
  EXPECT_TRUE(builder.take_image_errors().empty());
}

TEST(SubmapBuilder, ImagesElsewhereThanAtAKeyframeAreRefused) {
  SubmapBuilder builder(RobotId{3}, {});
  EXPECT_FALSE(builder.add(images_at(at(0.0), 0.0)).has_value());
  ASSERT_TRUE(builder.add(OdometrySample{at(0.0), ahead(0.0), kStepCovariance}).has_value());
  EXPECT_FALSE(builder.add(images_at(at(1.1), 0.0)).has_value());
  EXPECT_TRUE(builder.add(images_at(at(0.0), 0.0)).has_value());
  EXPECT_FALSE(builder.add(images_at(at(0.0), 0.0)).has_value());  // again
  ASSERT_TRUE(builder.add(OdometrySample{at(0.1), ahead(0.05), kStepCovariance}).has_value());
  EXPECT_FALSE(builder.add(images_at(at(0.1), 0.05)).has_value());  // no keyframe
  ASSERT_TRUE(builder.add(OdometrySample{at(2.0), ahead(1.0), kStepCovariance}).has_value());
  TrackedImages bad = images_at(at(2.0), 1.0);
  bad.images[0].keypoints[1].track = bad.images[0].keypoints[0].track;
  EXPECT_FALSE(builder.add(bad).has_value());
  bad = images_at(at(2.0), 1.0);
  bad.cameras = std::make_shared<const std::vector<Camera>>(2, bad.cameras->front());
  EXPECT_FALSE(builder.add(bad).has_value());  // not the robot's cameras
}

}  // namespace submap_builder_test
}  // namespace tutti::robot
