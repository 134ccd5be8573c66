// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/mission_input.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "tutti/formats/trajectory_file.hpp"

namespace tutti::lab {
namespace mission_input_test {

/// A folder with one straight recording of 100 samples, a tenth of a second and 10 cm apart.
class MissionInput : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / "tutti_mission_input_test" /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_);
    for (int i = 0; i < 100; ++i)
      recorded_.push_back({Timestamp{1'000'000'000LL} + 0.1 * i, {Eigen::Quaterniond::Identity(), {0.1 * i, 0, 0}}});
    ASSERT_TRUE(formats::write_tum((folder_ / "odometry.tum").string(), recorded_).has_value());
    config_.robots = {{.name = "a", .odometry = {.file = "odometry.tum"}, .reference = {.file = "odometry.tum"}}};
    config_.robot_changes.resize(1);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
  Trajectory recorded_;
  MissionConfig config_;
};

TEST_F(MissionInput, AClosurePlantedOnAnUnknownRobotIsAnError) {
  config_.closure_changes.planted = {{.robot = std::string("a"), .other = std::string("zulu")}};
  const auto input = load_input(config_, folder_, 1);
  ASSERT_FALSE(input.has_value());
  EXPECT_EQ(input.error().code, ErrorCode::configuration);
  EXPECT_NE(input.error().message.find("zulu"), std::string::npos) << input.error().message;
}

TEST_F(MissionInput, ARandomFrameMovesTheOdometryAndIsKnownToTheJudge) {
  config_.robot_changes[0].random_frame = true;
  const auto input = load_input(config_, folder_, 1);
  const auto again = load_input(config_, folder_, 1);
  const auto other = load_input(config_, folder_, 2);
  const mission::MissionRecording& robot = input->robots.front();
  EXPECT_EQ(robot.recording.odometry, again->robots.front().recording.odometry);
  EXPECT_NE(robot.recording.odometry, other->robots.front().recording.odometry);
  for (std::size_t i = 0; i < recorded_.size(); ++i)
    EXPECT_LT(local(*robot.T_common_odom * robot.recording.odometry[i].pose, recorded_[i].pose).norm(), 1e-9);
}

TEST_F(MissionInput, DegradedOdometryHasNoOneTrueFrame) {
  config_.robot_changes[0].degrade.yaw_deg_per_m = 1.0;
  const auto input = load_input(config_, folder_, 1);
  EXPECT_FALSE(input->robots.front().T_common_odom.has_value());
  EXPECT_EQ(input->robots.front().recording.reference, recorded_);
}

}  // namespace mission_input_test
}  // namespace tutti::lab
