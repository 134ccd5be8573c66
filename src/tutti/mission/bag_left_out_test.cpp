// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_left_out.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "support/bags/robot_bag.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/mission/bag_verdict.hpp"
#include "tutti/mission/recordings.hpp"

namespace tutti::mission {
namespace bag_left_out_test {

using namespace bags::test;
namespace fs = std::filesystem;

constexpr Timestamp kStart{1'700'000'000'000'000'000};
constexpr int kSteps = 200;  // of 0.1 s

/// From the one step to before the other.
struct Part {
  int from = 0, to = kSteps;
  [[nodiscard]] bool has(int step) const { return from <= step && step < to; }
};

class LeftOut : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / fmt::format("bag_left_out_{}", getpid());
    fs::create_directories(folder_);
    add(kStart, "/tf_static", kTf, tf_of(kStart, {{"base_link", "lidar", {}}}));
  }
  void TearDown() override { fs::remove_all(folder_); }

  void add(Timestamp logged, const std::string& topic, const std::string& type, const std::string& data) {
    all_.push_back(sample_of(topic, type, logged, data));
  }
  static Timestamp at(int step) { return kStart + 0.1 * step; }
  static Pose3 pose(int step) { return {Eigen::Quaterniond::Identity(), {0.1 * step, 0, 0}}; }
  void odometry(Part part, const std::string& topic = "/odom") {
    for (int i = part.from; i < part.to; ++i) add(at(i), topic, kOdometry, odometry_of(at(i), pose(i)));
  }
  void transforms(Part part) {
    for (int i = part.from; i < part.to; ++i) add(at(i), "/tf", kTf, tf_of(at(i), {{"odom", "base_link", pose(i)}}));
  }
  void scans(Part part, const std::string& topic = "/points") {
    for (int i = part.from; i < part.to; i += 2) add(at(i), topic, kCloud, cloud_of(at(i), "lidar", {{1, 2, 3}}));
  }
  /// The warnings of the bag, which run and info have, too.
  std::vector<std::string> warnings(const std::string& scans = "") {
    std::ranges::stable_sort(all_, {}, &Sample::ns);
    const std::string file = (folder_ / "alpha.mcap").string();
    write_bytes(file, mcap_of(all_, "", 100));
    MissionConfig config;
    RobotConfig robot;
    robot.name = "alpha";
    robot.bag = file;
    robot.topics.scans = scans;
    config.robots = {robot};
    const auto input = load_input(config, {}, 1);
    EXPECT_TRUE(input) << input.error().message;
    if (!input) return {};
    if (scans.empty()) {
      EXPECT_EQ(judge_bag(file, {}).warnings, input->robots.front().warnings);
    }
    return input->robots.front().warnings;
  }

  fs::path folder_;
  std::vector<Sample> all_;
};

TEST_F(LeftOut, NothingIsSaidOfATenth) {
  odometry({20, kSteps});
  scans({});
  EXPECT_EQ(warnings(), std::vector<std::string>());
}

TEST_F(LeftOut, TheTimeBeforeTheFirstTransform) {
  transforms({120, kSteps});
  scans({});
  EXPECT_EQ(warnings(), std::vector<std::string>{
                            "alpha: 60 % of the scans of /points (60 of 100) are left out: 60 before the odometry of "
                            "odom->base_link begins; record while odometry is there, or, if its clock is another one: "
                            "--set robots.alpha.scan_time_offset_s=SECONDS"});
}

TEST_F(LeftOut, OdometryThatEndsEarlyAndAnotherThatDoesNot) {
  odometry({0, 100});
  transforms({});
  scans({});
  const auto found = warnings();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NE(found[0].find("50 after it ends"), std::string::npos) << found[0];
  EXPECT_NE(found[0].find("; --topic 'alpha.odometry=odom->base_link' covers 100 %"), std::string::npos) << found[0];
}

TEST_F(LeftOut, ScansInAGapOfOdometry) {
  odometry({0, 80});
  odometry({140, kSteps});
  scans({});
  const auto found = warnings();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NE(found[0].find("30 in its gaps of more than 1 s"), std::string::npos) << found[0];
}

TEST_F(LeftOut, OdometryWithoutScans) {
  odometry({});
  scans({0, 60}, "/front");
  scans({}, "/top");
  const auto found = warnings("/front");
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(
      found[0],
      "alpha: no closure is found in 71 % of the odometry's time (14.1 of 19.9 s), as the scans of /front are not "
      "there: 0.0 s before they begin, 14.1 s after they end, 0.0 s in their pauses; --topic alpha.scans=/top "
      "leaves 0 %");
}

TEST_F(LeftOut, ScansThatAreRefused) {
  odometry({});
  scans({0, 120});
  for (int i = 120; i < kSteps; i += 2) add(at(i), "/points", kCloud, "broken");
  const auto found = warnings();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_TRUE(
      found[0].starts_with("alpha: 40 % of the scans of /points (40 of 100) are left out: 40 refused, the "
                           "first because: message 61: "))
      << found[0];
  EXPECT_NE(found[1].find("no closure is found in 41 % of the odometry's time"), std::string::npos) << found[1];
}

TEST_F(LeftOut, FixesThatAreNone) {
  odometry({});
  scans({});
  for (int i = 0; i < kSteps; i += 10) {
    bags::RosNavSatFix fix{.header = {at(i), "base_link"}};
    fix.latitude_deg = 48e7;  // as some receivers' protocols have it
    add(at(i), "/fix", "sensor_msgs/msg/NavSatFix", bags::encode(fix));
  }
  const auto found = warnings();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_TRUE(found[0].starts_with("alpha: 100 % of the fixes of /fix (20 of 20) are refused, the first because: "))
      << found[0];
}

TEST_F(LeftOut, AClockThatStartsAgain) {
  odometry({0, 60});
  scans({0, 60});
  for (int i = 100; i < 220; ++i) add(at(i), "/odom", kOdometry, odometry_of(at(i - 1000), pose(i)));
  for (int i = 100; i < 220; i += 2) add(at(i), "/points", kCloud, cloud_of(at(i - 1000), "lidar", {{1, 2, 3}}));
  const auto found = warnings();
  ASSERT_EQ(found.size(), 2U);
  EXPECT_TRUE(
      found[0].starts_with("alpha: 33 % of the odometry of /odom (60 of 180 poses) is left out: its clock "
                           "starts again 1 times:"))
      << found[0];
  EXPECT_NE(found[0].find("-o before.mcap --end-secs 1700000010, mcap filter"), std::string::npos) << found[0];
  EXPECT_NE(found[0].find("-o after.mcap --start-secs 1700000022"), std::string::npos) << found[0];
  EXPECT_NE(found[1].find("30 recorded with odometry that is left out"), std::string::npos) << found[1];
}

}  // namespace bag_left_out_test
}  // namespace tutti::mission
