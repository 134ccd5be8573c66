// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/recordings.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tutti/formats/trajectory_file.hpp"

namespace tutti::mission {
namespace recordings_test {

/// A folder with one straight recording of 100 samples, a tenth of a second and 10 cm apart.
class Recordings : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / "tutti_recordings_test" /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_ / "scans");
    for (int i = 0; i < 100; ++i)
      recorded_.push_back({Timestamp{1'000'000'000LL} + 0.1 * i, {Eigen::Quaterniond::Identity(), {0.1 * i, 0, 0}}});
    ASSERT_TRUE(formats::write_tum((folder_ / "odometry.tum").string(), recorded_).has_value());
    config_.robots = {{.name = "a", .odometry = {.file = "odometry.tum"}, .reference = {.file = "odometry.tum"}}};
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::string problem() const {
    const auto input = load_input(config_, folder_, 1);
    return input ? "" : input.error().message;
  }

  std::filesystem::path folder_;
  Trajectory recorded_;
  MissionConfig config_;
};

TEST_F(Recordings, AreReplayedAsTheyAre) {
  const auto input = load_input(config_, folder_, 1);
  ASSERT_TRUE(input.has_value()) << input.error().message;
  EXPECT_EQ(input->robots.front().recording.odometry, recorded_);
  EXPECT_EQ(input->robots.front().recording.increment_covariance.size(), 99U);
  ASSERT_TRUE(input->robots.front().T_common_odom.has_value());
  EXPECT_LT(local({}, *input->robots.front().T_common_odom).norm(), 1e-12);
}

/// As in UTM: floats have steps of half a metre there.
TEST_F(Recordings, FarFromTheOriginAreGivenFromANearerOne) {
  Trajectory far = recorded_;
  const Eigen::Vector3d utm(448'000.25, 5'572'000.5, 310.0);
  for (StampedPose& sample : far) sample.pose.translation += utm;
  ASSERT_TRUE(formats::write_tum((folder_ / "odometry.tum").string(), far).has_value());
  const auto input = load_input(config_, folder_, 1);
  ASSERT_TRUE(input.has_value()) << input.error().message;
  const MissionRecording& robot = input->robots.front();
  EXPECT_LT((robot.recording.odometry.front().pose.translation - Eigen::Vector3d(0.25, -0.5, 0.0)).norm(), 1e-6);
  EXPECT_LT(local(far[7].pose, *robot.T_common_odom * robot.recording.odometry[7].pose).norm(), 1e-6);
  EXPECT_EQ(robot.notes.front(),
            "a: odometry begins far from its origin: it is given, as is the map, from (448000 5572001 310) m on");
}

TEST_F(Recordings, ErrorsNameTheRobotOnce) {
  config_.robots[0].to_share = 0.01;
  EXPECT_EQ(problem(), "robot a: 1 odometry poses to replay, expected at least 2");
}

TEST_F(Recordings, HalvesMeetAndMissNothing) {
  config_.robots.push_back(config_.robots.front());
  config_.robots[0].to_share = config_.robots[1].from_share = 0.5;
  config_.robots[1].name = std::string("b");
  const auto input = load_input(config_, folder_, 1);
  ASSERT_TRUE(input.has_value());
  EXPECT_EQ(input->robots[0].recording.odometry.size() + input->robots[1].recording.odometry.size(), 100U);
  EXPECT_EQ(input->robots[1].recording.odometry.front(), recorded_[50]);
  EXPECT_EQ(input->robots[1].recording.robot, RobotId{1});
}

TEST_F(Recordings, AReferenceTransformThatIsNoneIsRefused) {
  config_.robots[0].reference_transform = std::string("T.txt");
  std::ofstream(folder_ / "T.txt") << "1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
  const auto input = load_input(config_, folder_, 1);
  ASSERT_TRUE(input.has_value()) << input.error().message;
  EXPECT_EQ(input->robots[0].recording.reference[0].pose.translation.x(), 5.0);
  std::ofstream(folder_ / "T.txt") << "2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n";
  EXPECT_NE(problem().find("T.txt:3: "), std::string::npos) << problem();
}

constexpr const char* kOnePoint =
    "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3\n";

TEST_F(Recordings, OnlyScansThatAreThereAreReplayed) {
  config_.robots[0].scans = std::string("scans");
  config_.robots[0].from_share = 0.1;
  std::ofstream(folder_ / "scans" / "000012.pcd") << kOnePoint;
  const auto input = load_input(config_, folder_, 1);
  ASSERT_TRUE(input.has_value()) << input.error().message;
  const Recording& recording = input->robots.front().recording;
  const auto there = recording.scans->scan(2);
  ASSERT_TRUE(there.has_value() && there->has_value());
  EXPECT_EQ((*there)->stamp, recording.odometry[2].stamp);
  EXPECT_EQ((*there)->cloud->points.size(), 1U);
  const auto absent = recording.scans->scan(3);  // the robot counts it among its troubles
  ASSERT_FALSE(absent.has_value());
  EXPECT_EQ(absent.error().message, (folder_ / "scans/000013.pcd").string() + " (or .bin): is not there");
  config_.robots[0].scans = std::string("nowhere");
  EXPECT_NE(problem().find("nowhere: no such folder"), std::string::npos) << problem();
}

TEST_F(Recordings, OfWhichNoScanCanBeReadAreRefused) {
  config_.robots[0].scans = std::string("scans");
  for (int number = 0; number < 100; ++number)
    std::ofstream(folder_ / "scans" / fmt::format("{:06d}.pcd", number)) << std::string(kOnePoint, 35);
  EXPECT_NE(problem().find("robot a: "), std::string::npos) << problem();
  EXPECT_NE(problem().find("000000.pcd: no DATA line"), std::string::npos) << problem();
  std::ofstream(folder_ / "scans" / "000001.pcd") << kOnePoint;
  const auto input = load_input(config_, folder_, 1);
  ASSERT_TRUE(input.has_value()) << input.error().message;
  EXPECT_EQ(input->robots[0].notes,
            (std::vector<std::string>{"a: scans are taken as deskewed to the stamps of their poses"}));
}

TEST_F(Recordings, ScansOfOtherNamesAreNotPassedOver) {
  config_.robots[0].scans = std::string("scans");
  config_.robots[0].from_share = 0.1;
  for (const char* name : {"13.pcd", "scan_000012.pcd", "000012.PCD", "000009.pcd"})  // the last is out of range
    std::ofstream(folder_ / "scans" / name) << kOnePoint;
  EXPECT_NE(problem().find("scans: holds none of 000010.pcd (or .bin) to 000099.pcd"), std::string::npos) << problem();
  std::ofstream(folder_ / "scans" / "000099.pcd") << kOnePoint;
  EXPECT_EQ(problem(), "");
}

TEST_F(Recordings, AReferenceOfAnotherClockIsAnError) {
  Trajectory late = recorded_;
  for (StampedPose& sample : late) sample.stamp = sample.stamp + 1e6;
  ASSERT_TRUE(formats::write_tum((folder_ / "reference.tum").string(), late).has_value());
  config_.robots[0].reference.file = "reference.tum";
  EXPECT_NE(problem().find("robot a: reference: of its 100 stamps"), std::string::npos) << problem();
  EXPECT_NE(problem().find("none meets the odometry's 100"), std::string::npos) << problem();
}

TEST_F(Recordings, KittiPosesReadAsTumSaySo) {
  std::ofstream(folder_ / "poses.txt") << "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n";
  config_.robots[0].odometry.file = "poses.txt";
  config_.robots[0].odometry.format = "tum";
  EXPECT_NE(problem().find("it is read as tum, and looks like kitti: state format: kitti"), std::string::npos)
      << problem();
}

TEST_F(Recordings, OdometryMayHaveAnotherRateThanItsSensors) {
  config_.odometry_hz = 47.0;
  const auto input = load_input(config_, folder_, 1);
  ASSERT_TRUE(input.has_value()) << input.error().message;
  const Recording& recording = input->robots[0].recording;
  ASSERT_GT(recording.odometry.size(), 460U);
  ASSERT_EQ(recording.increment_covariance.size() + 1, recording.odometry.size());
  ASSERT_EQ(recording.scan_stamps.size(), 100U);
  EXPECT_EQ(recording.scan_stamps[7], recorded_[7].stamp);
  Matrix6d sum = Matrix6d::Zero(), recorded = Matrix6d::Zero();
  for (const Matrix6d& step : recording.increment_covariance) sum += step;
  config_.odometry_hz = 0.0;
  const auto as_it_was = load_input(config_, folder_, 1);
  for (const Matrix6d& step : as_it_was->robots[0].recording.increment_covariance) recorded += step;
  EXPECT_LT((sum - recorded).norm(), 1e-9 * recorded.norm());
  for (const StampedPose& sample : recording.odometry)
    EXPECT_NEAR(sample.pose.translation.x(), sample.stamp - recorded_[0].stamp, 1e-6);
}

TEST_F(Recordings, ADuplicatedStampIsNotTheEndOfAMission) {
  std::ofstream(folder_ / "odometry.tum", std::ios::app)
      << "10.9 9.9 0 0 0 0 0 1\n3.5 0 0 0 0 0 0 1\n11 10 0 0 0 0 0 1\n";
  const auto input = load_input(config_, folder_, 1);
  ASSERT_TRUE(input.has_value()) << input.error().message;  // the reference is the same file
  EXPECT_EQ(input->robots[0].notes.size(), 4U);
  config_.robots[0].reference.file.clear();
  const auto without = load_input(config_, folder_, 1);
  ASSERT_TRUE(without.has_value()) << without.error().message;
  EXPECT_EQ(without->robots[0].recording.odometry.size(), 101U);
  ASSERT_EQ(without->robots[0].notes.size(), 2U);
  EXPECT_NE(without->robots[0].notes[0].find("odometry.tum: 2 rows left out, the first because: "), std::string::npos)
      << without->robots[0].notes[0];
}

}  // namespace recordings_test
}  // namespace tutti::mission
