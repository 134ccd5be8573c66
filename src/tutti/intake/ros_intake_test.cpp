// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/intake/ros_intake.hpp"

#include <gtest/gtest.h>

#include <random>

#include "support/intake/messages.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/node/odometry_gate.hpp"

namespace tutti::intake {
namespace ros_intake_test {

using test::fix, test::kAtOnce, test::kPeriod, test::kStart, test::kSweepAfter, test::kSweepBefore, test::odometry,
    test::points, test::transform;

std::string why(const Status& status) { return status ? "" : status.error().message; }

Status add_fix(RosIntake& intake, const std::string& bytes) { return intake.add_antenna("fix", bags::kFixType, bytes); }
std::optional<PositionFix> next_fix(RosIntake& intake) {
  auto input = intake.next_antenna();
  return input ? std::optional(std::get<PositionFix>(std::move(*input))) : std::nullopt;
}

/// All that is ready, one after the other as the robot gets it.
struct Fed {
  std::vector<OdometrySample> samples;
  std::vector<Scan> scans;
  std::vector<std::string> errors;
};
Fed feed(RosIntake& intake, bool wait_for_scans = false) {
  Fed out;
  while (auto sample = intake.next_odometry(wait_for_scans)) {
    out.samples.push_back(*sample);
    for (auto scan = intake.next_scan(true); !scan || *scan; scan = intake.next_scan(true)) {
      if (scan)
        out.scans.push_back(**scan);
      else
        out.errors.push_back(scan.error().message);
    }
  }
  return out;
}

TEST(RosIntake, IncrementsAreAsSureAsOfABag) {
  RosIntake intake({});
  Trajectory expected;
  for (int i = 0; i < 5; ++i) {
    expected.push_back({{kStart + i * kPeriod}, {Eigen::Quaterniond::Identity(), {0.3 * i, 0, 0}}});
    ASSERT_TRUE(intake.add_odometry(odometry(expected.back().stamp.ns, 0.3 * i)));
  }
  const auto covariances = robot::increment_covariances(expected, {});
  const Fed fed = feed(intake);
  ASSERT_EQ(fed.samples.size(), 5U);
  EXPECT_EQ(fed.samples[0].increment_covariance, Matrix6d::Zero());
  for (std::size_t i = 1; i < 5; ++i) {
    EXPECT_EQ(fed.samples[i].T_odom_body, expected[i].pose);
    EXPECT_EQ(fed.samples[i].increment_covariance, covariances[i - 1]);
  }
  EXPECT_EQ(intake.frames()->odom, "odom");
  EXPECT_EQ(intake.frames()->body, "base_link");
}

TEST(RosIntake, ScansWaitForTheOdometryOfTheirSweepAndLoseItsMotion) {
  for (const auto& times : {kSweepBefore, kSweepAfter}) {
    RosIntake intake({});
    const std::int64_t stamp = kStart + 2 * kPeriod;
    ASSERT_TRUE(intake.add_points(points(stamp, times)));
    const bool ends_after = times.back() > 0.0F;
    std::size_t scans = 0;
    for (int i = 0; i < 5; ++i) {
      ASSERT_TRUE(intake.add_odometry(odometry(kStart + i * kPeriod, 1.0 * i)));  // 10 m/s
      for (const Scan& scan : feed(intake).scans) {
        EXPECT_EQ(i, ends_after ? 3 : 2);
        EXPECT_EQ(scan.stamp.ns, stamp);
        EXPECT_EQ(scan.age_s, nullptr);
        ASSERT_EQ(scan.cloud->points.size(), 3U);
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(scan.cloud->points[k].x(), 5.0 + 10.0 * times[k], 1e-4);
        ++scans;
      }
    }
    EXPECT_EQ(scans, 1U);
    EXPECT_NE(intake.take_note().find("'time' is taken as s after the message's stamp"), std::string::npos);
    EXPECT_EQ(intake.take_note(), "");
  }
}

/// As a cloud with the same points and times.
TEST(RosIntake, ScansOfALivoxLoseTheMotionOfTheirSweep) {
  RosIntake intake({});
  ASSERT_TRUE(intake.add_points(test::livox(kStart), "livox_ros_driver2/msg/CustomMsg"));
  EXPECT_NE(why(intake.add_points(test::livox(kStart + kPeriod))).find("sensor_msgs/msg/PointCloud2: "),
            std::string::npos);
  std::vector<Scan> scans;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(intake.add_odometry(odometry(kStart + i * kPeriod, 1.0 * i)));  // 10 m/s
    for (const Scan& scan : feed(intake).scans) scans.push_back(scan);
  }
  ASSERT_EQ(scans.size(), 1U);
  ASSERT_EQ(scans[0].cloud->points.size(), 3U);
  const std::vector<Eigen::Vector3f> expected{{5, 0, 0}, {5.5F, 1, 0}, {6, 2, 0}};
  for (std::size_t k = 0; k < 3; ++k) EXPECT_LT((scans[0].cloud->points[k] - expected[k]).norm(), 1e-4F);
  EXPECT_NE(intake.take_note().find("'offset_time' is taken as ns after the message's stamp"), std::string::npos);
}

TEST(RosIntake, TheLidarIsWhereStaticTransformsSay) {
  RosIntake intake({});
  const Pose3 T_base_mast{Eigen::Quaterniond::Identity(), {0, 0, 1}},
      T_mast_lidar{Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())), {0, 0, 0.5}};
  ASSERT_TRUE(intake.add_tf(transform(0, "base_link", "mast", T_base_mast), true));
  ASSERT_TRUE(intake.add_points(points(kStart, kAtOnce, "lidar")));
  ASSERT_TRUE(intake.add_odometry(odometry(kStart)));
  intake.end();  // or it would be waited for
  const Fed early = feed(intake);
  ASSERT_EQ(early.errors.size(), 1U);
  EXPECT_NE(early.errors[0].find("no transform from 'lidar' to 'base_link' on /tf_static, frames that do not move are: "
                                 "base_link, mast"),
            std::string::npos)
      << early.errors[0];
  ASSERT_TRUE(intake.add_tf(transform(0, "mast", "lidar", T_mast_lidar), true));
  ASSERT_TRUE(intake.add_points(points(kStart + kPeriod, kAtOnce, "lidar")));
  ASSERT_TRUE(intake.add_odometry(odometry(kStart + kPeriod)));
  const Fed fed = feed(intake);
  ASSERT_EQ(fed.scans.size(), 1U);
  EXPECT_LT((fed.scans[0].cloud->points[0] - Eigen::Vector3f(0, 5, 1.5F)).norm(), 1e-5F);
}

/// Two robots may use the same frames, each in its own namespace.
/// Who publishes it may be discovered after the LiDAR.
TEST(RosIntake, TheFirstScansAndOdometrySinceWaitForTheTransformOfTheLidar) {
  for (const bool comes : {true, false}) {
    RosIntake intake({});
    constexpr auto kHeld = static_cast<int>(waiting::kUnknown_s / (kPeriod * 1e-9));
    Fed fed;
    const auto take = [&](const Fed& more) {
      fed.samples.insert(fed.samples.end(), more.samples.begin(), more.samples.end());
      fed.scans.insert(fed.scans.end(), more.scans.begin(), more.scans.end());
      fed.errors.insert(fed.errors.end(), more.errors.begin(), more.errors.end());
    };
    ASSERT_TRUE(intake.add_odometry(odometry(kStart)));
    take(feed(intake));
    EXPECT_EQ(fed.samples.size(), 1U) << "nothing is known of a LiDAR";
    for (int i = 1; i <= kHeld; ++i) {
      ASSERT_TRUE(intake.add_points(points(kStart + i * kPeriod, kSweepBefore, "lidar")));
      ASSERT_TRUE(intake.add_odometry(odometry(kStart + i * kPeriod, 0.1 * i)));
      take(feed(intake));
    }
    EXPECT_EQ(fed.samples.size(), 1U);
    EXPECT_TRUE(fed.errors.empty());
    const std::size_t kept = std::min<std::size_t>(kHeld, RosIntake::kMostScans);
    if (comes) {
      ASSERT_TRUE(intake.add_tf(transform(0, "base_link", "lidar", {}), true));
    }
    for (int i = kHeld + 1; i < kHeld + 3; ++i)
      ASSERT_TRUE(intake.add_odometry(odometry(kStart + i * kPeriod, 0.1 * i)));
    take(feed(intake));
    EXPECT_EQ(fed.samples.size(), kHeld + 3U);
    EXPECT_EQ(fed.scans.size(), comes ? kept : 0U);
    EXPECT_EQ(fed.errors.size(), comes ? 0U : kept);
    ASSERT_TRUE(intake.add_points(points(kStart + (kHeld + 3) * kPeriod, kSweepBefore, "lidar")));
    ASSERT_TRUE(intake.add_odometry(odometry(kStart + (kHeld + 3) * kPeriod, 0.1 * (kHeld + 3))));
    EXPECT_EQ(feed(intake).samples.size(), 1U) << "it is waited for once";
  }
}

TEST(RosIntake, TransformsOfTheRobotAloneCountBeforeThoseOfAll) {
  using Of = RosIntake::TfOf;
  RosIntake intake({.odometry_frames = "odom->base_link"});
  const auto at = [](double x) { return Pose3{Eigen::Quaterniond::Identity(), {x, 0, 0}}; };
  ASSERT_TRUE(intake.add_tf(transform(0, "base_link", "lidar", at(9)), true, Of::all));
  ASSERT_TRUE(intake.add_tf(transform(0, "base_link", "mast", at(1)), true, Of::all));
  ASSERT_TRUE(intake.add_tf(transform(0, "base_link", "lidar", at(2)), true, Of::robot));
  ASSERT_TRUE(intake.add_tf(transform(0, "mast", "gnss", at(3)), true, Of::robot));
  ASSERT_TRUE(intake.add_tf(transform(kStart, "odom", "base_link", at(0)), false, Of::robot));
  ASSERT_TRUE(intake.add_tf(transform(kStart + kPeriod, "odom", "base_link", at(70)), false, Of::all));
  ASSERT_TRUE(intake.add_tf(transform(kStart + 2 * kPeriod, "odom", "base_link", at(0.1)), false, Of::robot));
  const Fed fed = feed(intake);
  ASSERT_EQ(fed.samples.size(), 2U);
  EXPECT_EQ(fed.samples[1].T_odom_body, at(0.1));
  EXPECT_EQ(intake.pose_on_body("lidar").value(), at(2));
  EXPECT_EQ(intake.pose_on_body("mast").value(), at(1));  // in that of all only
  EXPECT_EQ(intake.pose_on_body("gnss").value(), at(4));  // by both
}

TEST(RosIntake, FixesWaitForTheirOdometryAndTheirAntennaIsWhereStaticTransformsSay) {
  RosIntake intake({});
  ASSERT_TRUE(add_fix(intake, fix(kStart - kPeriod, "gnss")));
  ASSERT_TRUE(add_fix(intake, fix(kStart + kPeriod / 2, "gnss")));
  EXPECT_FALSE(next_fix(intake));
  ASSERT_TRUE(intake.add_odometry(odometry(kStart)));
  feed(intake);
  EXPECT_FALSE(next_fix(intake));  // the first is from before all odometry
  ASSERT_TRUE(intake.add_odometry(odometry(kStart + kPeriod)));
  feed(intake);
  const auto early = next_fix(intake);
  ASSERT_TRUE(early);
  EXPECT_EQ(early->stamp.ns, kStart + kPeriod / 2);
  EXPECT_EQ(early->antenna, (Geodetic{46.5, 7.9, 600.0}));
  EXPECT_EQ(early->covariance, Eigen::Matrix3d::Identity());
  EXPECT_EQ(early->p_body_antenna, Eigen::Vector3d::Zero());
  EXPECT_NE(intake.take_note().find("no transform from 'gnss' to 'base_link' on /tf_static"), std::string::npos);
  EXPECT_FALSE(next_fix(intake));

  const Pose3 T_base_gnss{Eigen::Quaterniond::Identity(), {0.5, 0.1, 1.2}};
  ASSERT_TRUE(intake.add_tf(transform(0, "base_link", "gnss", T_base_gnss), true));
  for (int i = 2; i < 4; ++i) {
    ASSERT_TRUE(add_fix(intake, fix(kStart + i * kPeriod, "/gnss")));
    ASSERT_TRUE(intake.add_odometry(odometry(kStart + i * kPeriod)));
  }
  feed(intake);
  for (int i = 2; i < 4; ++i) EXPECT_EQ(next_fix(intake)->p_body_antenna, T_base_gnss.translation);
  EXPECT_EQ(intake.take_note(), "fixes are of an antenna at [0.50 0.10 1.20] m of the body");
  bags::RosNavSatFix unsure = bags::to_ros({{kStart + 4 * kPeriod}, "gnss"}, {46.5, 7.9, 600.0});
  ASSERT_TRUE(add_fix(intake, bags::encode(unsure)));
  unsure.header.stamp.ns += kPeriod / 2;
  unsure.status = -1;
  ASSERT_TRUE(add_fix(intake, bags::encode(unsure)));  // none
  ASSERT_TRUE(intake.add_odometry(odometry(kStart + 5 * kPeriod)));
  feed(intake);
  EXPECT_EQ(next_fix(intake)->covariance, unknown_fix_covariance());
  EXPECT_NE(intake.take_note().find("count as 5 m and 10 m up"), std::string::npos);
  EXPECT_FALSE(next_fix(intake));
  EXPECT_EQ(intake.counts().fixes, 5U);
}

TEST(RosIntake, WhatIsPublishedAndNotHeardIsCounted) {
  RosIntake intake({});
  for (int i = 0; i < 40; ++i) {
    const std::int64_t stamp = kStart + i * kPeriod;
    if (i < 20 || i % 4 != 0) {
      ASSERT_TRUE(intake.add_odometry(odometry(stamp)));
    }
    if (i < 20 || i % 3 != 0) {
      ASSERT_TRUE(intake.add_points(points(stamp, kAtOnce)));
    }
    feed(intake);
  }
  EXPECT_EQ(intake.counts().missed, 5U);
  EXPECT_EQ(intake.counts().missed_scans, 6U);  // the last of all has none behind it
}

TEST(RosIntake, AMissionMaySayWhereTheAntennaIs) {
  RosIntake intake({.odometry_frames = {},
                    .covariance = {},
                    .scan_times = {},
                    .T_body_lidar = {},
                    .p_body_antenna = Eigen::Vector3d(1, 2, 3)});
  ASSERT_TRUE(intake.add_odometry(odometry(kStart)));
  ASSERT_TRUE(add_fix(intake, fix(kStart, "gnss")));
  feed(intake);
  EXPECT_EQ(next_fix(intake)->p_body_antenna, Eigen::Vector3d(1, 2, 3));
}

TEST(RosIntake, OdometryMayBeTwoFramesOfTf) {
  RosIntake intake({.odometry_frames = "odom->base_link",
                    .covariance = {},
                    .scan_times = {},
                    .T_body_lidar = {},
                    .p_body_antenna = {}});
  for (int i = 0; i < 3; ++i) {
    const Pose3 T{Eigen::Quaterniond::Identity(), {0.1 * i, 0, 0}};
    ASSERT_TRUE(intake.add_tf(transform(kStart + i * kPeriod, "odom", "base_link", T), false));
    ASSERT_TRUE(intake.add_tf(transform(kStart + i * kPeriod, "odom", "base_link", T), false));  // sent again
    ASSERT_TRUE(intake.add_tf(transform(kStart + i * kPeriod, "base_link", "wheel", T), false));
  }
  EXPECT_EQ(feed(intake).samples.size(), 3U);
  EXPECT_EQ(intake.counts().refused, 0U);
}

TEST(RosIntake, WhereNothingMayBeLostOdometryWaitsForScans) {
  RosIntake intake({});
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(intake.add_odometry(odometry(kStart + i * kPeriod)));
  EXPECT_EQ(feed(intake, true).samples.size(), 0U);
  ASSERT_TRUE(intake.add_points(points(kStart + 2 * kPeriod, kAtOnce)));
  const Fed fed = feed(intake, true);
  EXPECT_EQ(fed.samples.size(), 3U);
  EXPECT_EQ(fed.scans.size(), 1U);
  EXPECT_EQ(feed(intake, false).samples.size(), 1U);
}

TEST(RosIntake, WhatTheRobotHasIsPassedOverAndTheMotionSinceIsUnseen) {
  RosIntake intake({});
  intake.begin_behind(Timestamp{kStart + kPeriod + 1});
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(intake.add_odometry(odometry(kStart + i * kPeriod)));
  const Fed fed = feed(intake);
  ASSERT_EQ(fed.samples.size(), 2U);
  EXPECT_EQ(fed.samples[0].increment_covariance(0, 0), 1.0);
  EXPECT_LT(fed.samples[1].increment_covariance(0, 0), 0.01);
  intake.begin_behind(Timestamp{kStart + 3 * kPeriod});  // the same connection's end and another one's begin
  ASSERT_TRUE(intake.add_odometry(odometry(kStart + 4 * kPeriod)));
  EXPECT_LT(feed(intake).samples.at(0).increment_covariance(0, 0), 0.01);
}

TEST(RosIntake, OneStampInTheFutureShutsOutNothing) {
  constexpr std::int64_t kHour = 3'600'000'000'000;
  RosIntake intake({});
  ASSERT_TRUE(intake.add_points(points(kStart + kHour, kAtOnce)));  // nobody can know that it is wrong
  ASSERT_TRUE(add_fix(intake, fix(kStart + kHour)));
  ASSERT_TRUE(intake.add_odometry(odometry(kStart)));
  EXPECT_NE(why(intake.add_odometry(odometry(kStart + kHour))).find("3600 s ahead"), std::string::npos);
  std::size_t scans = 0, fixes = 0, samples = 0;
  for (int i = 1; i < 20; ++i) {
    ASSERT_TRUE(intake.add_points(points(kStart + i * kPeriod, kAtOnce)));
    if (i == 5) {
      ASSERT_TRUE(intake.add_points(points(kStart + i * kPeriod + 5'000'000'000, kAtOnce)));
    }
    ASSERT_TRUE(add_fix(intake, fix(kStart + i * kPeriod)));
    ASSERT_TRUE(intake.add_odometry(odometry(kStart + i * kPeriod)));
    const Fed fed = feed(intake);
    samples += fed.samples.size();
    scans += fed.scans.size();
    while (next_fix(intake)) ++fixes;
  }
  EXPECT_EQ(samples, 20U);
  EXPECT_EQ(scans, 19U);
  EXPECT_EQ(fixes, 19U);
}

TEST(RosIntake, ALidarWithAClockOfItsOwnIsReportedAndAligned) {
  constexpr std::int64_t kAhead = 37'000'000'000;
  for (const double offset_s : {0.0, -37.0}) {
    RosIntake intake({.odometry_frames = {},
                      .covariance = {},
                      .scan_times = {},
                      .scan_offset_s = offset_s,
                      .T_body_lidar = {},
                      .p_body_antenna = {}});
    std::size_t scans = 0;
    std::string errors;
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE(intake.add_odometry(odometry(kStart + i * kPeriod, 1.0 * i)));
      if (i < 5) continue;
      errors = why(intake.add_points(points(kStart + i * kPeriod + kAhead, kSweepBefore)));
      for (const Scan& scan : feed(intake).scans) {
        EXPECT_EQ(scan.stamp.ns, kStart + i * kPeriod);
        EXPECT_NEAR(scan.cloud->points[0].x(), 5.0 - 1.0, 1e-4);
        ++scans;
      }
    }
    EXPECT_EQ(scans, offset_s == 0.0 ? 0U : 15U);
    EXPECT_EQ(errors.find("to align them: robots[].scan_time_offset_s=-37)") != std::string::npos, offset_s == 0.0)
        << errors;
  }
}

TEST(RosIntake, ScansThatLagAreDoubtedWithTheNumberAndALidarFarAwayIs) {
  RosIntake intake({.odometry_frames = {},
                    .covariance = {},
                    .scan_times = {},
                    .T_body_lidar = Pose3{Eigen::Quaterniond::Identity(), {0, 0, 800}},
                    .p_body_antenna = {}});
  std::string notes;
  for (int i = 0; i < 60; ++i) {
    ASSERT_TRUE(intake.add_odometry(odometry(kStart + i * kPeriod)));
    if (i >= 20) {
      ASSERT_TRUE(intake.add_points(points(kStart + (i - 20) * kPeriod, kAtOnce)));
    }
    notes += intake.take_note();
    feed(intake);
    notes += intake.take_note();
  }
  EXPECT_NE(notes.find("scans: when they arrive, stamps are 2.0 s behind odometry's newest"), std::string::npos)
      << notes;
  EXPECT_NE(notes.find("the LiDAR is 800.0 m from the body's origin"), std::string::npos) << notes;
}

// Also after the robot was started again: it knows of stamps from before.
TEST(RosIntake, AClockThatGoesBackIsFedAsTheRobotIsToSeeIt) {
  for (const bool is_new : {false, true}) {
    RosIntake intake({});
    if (is_new) intake.begin_behind(Timestamp{kStart});
    EXPECT_TRUE(intake.add_odometry(odometry(kStart)));
    feed(intake);
    node::OdometryGate robot(RobotId{1}, Timestamp{kStart});
    std::size_t fed = 0, taken = 0, scans = 0, anew = 0;
    for (int i = 0; i < 60; ++i) {
      static_cast<void>(intake.add_odometry(odometry(i * kPeriod, 0.1 * i)));
      static_cast<void>(intake.add_points(points(i * kPeriod, kAtOnce)));
      const Fed now = feed(intake);
      for (const OdometrySample& sample : now.samples) {
        const auto passed = robot.take(sample);
        taken += passed ? 1 : 0;
        anew += passed && !passed->why_anew.empty() ? 1 : 0;
      }
      fed += now.samples.size();
      scans += now.scans.size();
    }
    EXPECT_EQ(fed, 60U);
    EXPECT_EQ(anew, 1U);
    EXPECT_GT(taken, 35U);
    EXPECT_GT(scans, 35U);
  }
}

TEST(RosIntake, WhatIsWrongIsReported) {
  RosIntake intake({});
  ASSERT_TRUE(intake.add_odometry(odometry(kStart)));
  const auto expect = [](const std::string& errors, const std::string& part) {
    EXPECT_NE(errors.find(part), std::string::npos) << errors;
  };
  expect(why(intake.add_odometry(odometry(kStart))), "expected after 1700000000000000000 ns: two publishers");
  expect(why(intake.add_odometry(odometry(kStart + 1, 0.0, "map"))),
         "frames 'map' -> 'base_link', expected 'odom' -> 'base_link' as of the first message");
  expect(why(intake.add_odometry(odometry(kStart + 1, 1e12))), "position");
  expect(why(intake.add_odometry(odometry(kStart + 1, 0.0, std::string("\x1b[2J")))), "frames '?[2J'");
  expect(why(intake.add_points(points(kStart - 20'000'000'000, kAtOnce))),
         "from odometry's newest, 1700000000000000000 ns: are they by "
         "another clock?");
  expect(why(intake.add_points(points(kStart, {}))), "holds no points");
  expect(why(intake.add_points(odometry(kStart))), "sensor_msgs/msg/PointCloud2: ");
  expect(why(intake.add_odometry("")), "nav_msgs/msg/Odometry");
  ASSERT_TRUE(intake.add_points(points(kStart, kAtOnce)));
  expect(why(intake.add_points(points(kStart, kAtOnce))), "two publishers");
  expect(why(add_fix(intake, fix(kStart, "gnss", 91.0))), "latitude 91 degrees, expected -90 to 90");
  expect(why(add_fix(intake, fix(kStart - 20'000'000'000))), "are they by another clock?");
  expect(why(add_fix(intake, odometry(kStart))), "sensor_msgs/msg/NavSatFix: ");
  ASSERT_TRUE(add_fix(intake, fix(kStart)));
  expect(why(add_fix(intake, fix(kStart - 1))), "two publishers");
  EXPECT_EQ(intake.counts().refused, 13U);
  EXPECT_EQ(intake.counts().odometry, 1U);
}

TEST(RosIntake, FramesOfStrangersHaveAnEnd) {
  RosIntake intake({});
  std::string errors;
  for (std::size_t i = 0; i <= RosIntake::kMostFrames; ++i)
    errors += why(intake.add_tf(transform(0, "world", fmt::format("frame_{}", i), {}), false));
  EXPECT_EQ(errors, "frame 'frame_1000' is one more than 1000");
}

TEST(RosIntake, ScansAndFixesWithoutOdometryHaveAnEnd) {
  RosIntake intake({});
  for (std::size_t i = 0; i < 2 * RosIntake::kMostAntennas; ++i)
    ASSERT_TRUE(add_fix(intake, fix(kStart + static_cast<std::int64_t>(i))));
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(intake.add_points(points(kStart + i * kPeriod, kAtOnce)));
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(intake.add_odometry(odometry(kStart + (99 * i) * kPeriod)));
  EXPECT_EQ(feed(intake).scans.size(), RosIntake::kMostScans);
  std::size_t fixes = 0;
  while (next_fix(intake)) ++fixes;
  EXPECT_EQ(fixes, RosIntake::kMostAntennas);
}

/// Any byte of any message may be wrong, and any message cut.
TEST(RosIntake, BytesOfStrangersDoNoHarm) {
  RosIntake intake({});
  std::mt19937 rng(1);
  const std::vector<std::string> good{odometry(kStart), points(kStart, kSweepBefore),
                                      transform(kStart, "base_link", "lidar", {}), fix(kStart)};
  std::size_t refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes = good[rng() % good.size()];
    for (std::size_t k = rng() % 4; k > 0; --k) bytes[rng() % bytes.size()] = static_cast<char>(rng());
    if (rng() % 3 == 0) bytes.resize(rng() % bytes.size());
    const std::size_t kind = rng() % 4;
    const Status taken = kind == 0   ? intake.add_odometry(bytes)
                         : kind == 1 ? intake.add_points(bytes)
                         : kind == 2 ? add_fix(intake, bytes)
                                     : intake.add_tf(bytes, i % 2 == 0);
    refused += taken ? 0 : 1;
    if (i % 10 == 0) feed(intake);
    while (next_fix(intake)) continue;
  }
  EXPECT_GT(refused, 15'000U);
}

}  // namespace ros_intake_test
}  // namespace tutti::intake
