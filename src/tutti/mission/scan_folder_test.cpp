// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/scan_folder.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tutti/formats/pcd.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::mission {
namespace scan_folder_test {

constexpr double kSweep_s = 0.1;
const std::vector<Eigen::Vector3d> kFixed = {{10, 0, 0}, {9, 4, 1}, {0, 8, 2}, {-6, 1, 0}, {3, -7, 1}};

/// A robot that drives a curve, with a LiDAR that sits on it askew and sees fixed points one after the other.
class Scans : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / "tutti_scan_folder_test" /
              testing::UnitTest::GetInstance()->current_test_info()->name();
    std::filesystem::create_directories(folder_);
    robot_.T_body_lidar = {.translation_m = {0.3, -0.1, 0.5}, .quaternion_xyzw = {}, .rpy_deg = {180.0, 10.0, 90.0}};
    for (int i = 0; i <= 20; ++i) odometry_.push_back({Timestamp{5'000'000'000} + 0.1 * i, T_odom_body(0.1 * i)});
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  /// Constant velocities.
  static Pose3 T_odom_body(double time_s) {
    return Pose3{so3_exp({0.1, 0.2, 0.3}), {5, 6, 7}} *
           Pose3{so3_exp(Eigen::Vector3d(0.0, 0.1, 1.0) * time_s), Eigen::Vector3d(3.0, 0.5, 0.0) * time_s};
  }
  /// Writes the LiDAR's points of the sweep that ends at a sample; `stamped`: with times in ns since its begin.
  void write_scan(int number, double begin_s, bool stamped) {
    const Pose3 T_body_lidar = to_pose(robot_.T_body_lidar).value();
    std::string text = fmt::format(
        "VERSION 0.7\nFIELDS x y z{}\nSIZE 4 4 4{}\nTYPE F F F{}\nWIDTH {}\nHEIGHT 1\nPOINTS {}\nDATA ascii\n",
        stamped ? " t" : "", stamped ? " 4" : "", stamped ? " U" : "", kFixed.size(), kFixed.size());
    for (std::size_t i = 0; i < kFixed.size(); ++i) {
      const double after_s = kSweep_s * static_cast<double>(i) / static_cast<double>(kFixed.size() - 1);
      const Pose3 T_odom_lidar = T_odom_body(begin_s + (stamped ? after_s : kSweep_s)) * T_body_lidar;
      const Eigen::Vector3d p = T_odom_lidar.inverse() * kFixed[i];
      text += fmt::format("{} {} {}", p.x(), p.y(), p.z());
      text += stamped ? fmt::format(" {:.0f}\n", 1e9 * after_s) : "\n";
    }
    std::ofstream(folder_ / fmt::format("{:06d}.pcd", number)) << text;
  }
  [[nodiscard]] std::shared_ptr<const ScanFolder> opened(std::size_t first = 0) const {
    auto scans = ScanFolder::open(folder_, {.first = first}, odometry_, robot_);
    EXPECT_TRUE(scans) << scans.error().message;
    return scans ? *scans : nullptr;
  }
  [[nodiscard]] std::string problem() const {
    const auto scans = ScanFolder::open(folder_, {}, odometry_, robot_);
    return scans ? "" : scans.error().message;
  }
  /// The largest distance of the points from where they belong in the body frame of a sample.
  [[nodiscard]] double error_m(const ScanFolder& scans, std::size_t sample) const {
    const auto scan = scans.scan(sample);
    EXPECT_TRUE(scan && *scan) << scan.error().message;
    if (!scan || !*scan || (*scan)->cloud->points.size() != kFixed.size()) return 1e9;
    EXPECT_EQ((*scan)->stamp, odometry_[sample].stamp);
    EXPECT_EQ((*scan)->age_s, nullptr);
    double worst = 0.0;
    for (std::size_t i = 0; i < kFixed.size(); ++i)
      worst = std::max(worst, (odometry_[sample].pose * (*scan)->cloud->points[i].cast<double>() - kFixed[i]).norm());
    return worst;
  }

  std::filesystem::path folder_;
  RobotConfig robot_;
  Trajectory odometry_;
};

TEST_F(Scans, ComeOutInTheBodyFrame) {
  write_scan(3, 0.2, false);
  EXPECT_LT(error_m(*opened(), 3), 1e-4);
  EXPECT_TRUE(opened(3)->scan(0));  // numbered from the first of the recording
  EXPECT_FALSE(opened(3)->scan(3));
  robot_.T_body_lidar.rpy_deg[2] += 1.0;
  EXPECT_GT(error_m(*opened(), 3), 0.1);
}

// Straight and of constant turn between two samples: a curve of 0.1 s is off by millimetres, an uncorrected sweep by 1
// m.
TEST_F(Scans, AreDeskewedToTheEndOfTheSweep) {
  for (const int number : {0, 1, 7, 20}) write_scan(number, 0.1 * number - kSweep_s, true);
  const auto scans = opened();
  EXPECT_NE(scans->note().find("'t' is taken as ns since the sweep's begin"), std::string::npos) << scans->note();
  EXPECT_LT(error_m(*scans, 1), 0.02);
  EXPECT_LT(error_m(*scans, 20), 0.02);
  EXPECT_LT(error_m(*scans, 0), 0.05);  // under way before the first sample
  robot_.scans_deskewed = "yes";
  EXPECT_GT(error_m(*opened(), 7), 0.5);
}

TEST_F(Scans, AreDeskewedToTheBeginOfTheSweep) {
  robot_.scan_pose_at = "begin";
  for (const int number : {0, 7, 20}) write_scan(number, 0.1 * number, true);
  const auto scans = opened();
  EXPECT_LT(error_m(*scans, 0), 0.02);
  EXPECT_LT(error_m(*scans, 7), 0.02);
  EXPECT_LT(error_m(*scans, 20), 0.05);  // goes on behind the last sample
}

TEST_F(Scans, StampsMayBeClose) {  // the poses beyond the ends are not as many as nanoseconds
  odometry_ = {{Timestamp{5}, {}}, {Timestamp{6}, {}}};
  write_scan(0, 0.0, true);
  EXPECT_TRUE(opened()->scan(0));
}

TEST_F(Scans, OfKittiAreRead) {
  std::string bytes;
  for (const float value : {1.0F, 2.0F, 3.0F, 0.5F}) bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  std::ofstream(folder_ / "000002.bin", std::ios::binary) << bytes;
  robot_.T_body_lidar = {};
  const auto scan = opened()->scan(2);
  ASSERT_TRUE(scan && *scan);
  EXPECT_EQ((*scan)->cloud->points, (std::vector<Eigen::Vector3f>{{1, 2, 3}}));
}

TEST_F(Scans, NoneThatCanBeReadIsAnError) {
  EXPECT_NE(problem().find("holds none of 000000.pcd (or .bin) to 000020.pcd"), std::string::npos) << problem();
  for (int number = 4; number < 9; ++number) std::ofstream(folder_ / fmt::format("{:06d}.pcd", number)) << "no scan";
  EXPECT_NE(problem().find("000004.pcd:1: header keyword is 'no'"), std::string::npos) << problem();
  write_scan(8, 0.7, false);
  EXPECT_EQ(problem(), "");
  std::ofstream(folder_ / "000003.pcd") << "none";
  EXPECT_EQ(problem(), "");  // five are none, the sixth is one
  std::filesystem::remove(folder_ / "000008.pcd");
  EXPECT_NE(problem().find("000003.pcd"), std::string::npos) << problem();
  EXPECT_FALSE(ScanFolder::open(folder_ / "nowhere", {}, odometry_, robot_));
}

TEST_F(Scans, WithoutPointsAreNoScans) {
  std::ofstream(folder_ / "000000.pcd") << "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nPOINTS 0\nDATA ascii\n";
  EXPECT_NE(problem().find("000000.pcd: holds no points"), std::string::npos) << problem();
}

TEST_F(Scans, TheirTroubleNamesTheFile) {
  write_scan(0, 0.0, false);
  robot_.scans_deskewed = "no";
  EXPECT_NE(problem().find("000000.pcd: points carry no time"), std::string::npos) << problem();
  write_scan(0, 0.0, true);
  write_scan(1, 0.0, false);
  const auto scan = opened()->scan(1);
  ASSERT_FALSE(scan);
  EXPECT_NE(scan.error().message.find("000001.pcd: points carry no time"), std::string::npos) << scan.error().message;
}

// A scan on the wrong pose is worse than none.
TEST_F(Scans, NumberedFromOneOrOfNoPoseAreRefused) {
  for (int number = 1; number <= 21; ++number) write_scan(number, 0.0, false);
  EXPECT_NE(problem().find("scan 000021 belongs to no pose or stamp: there are 21 of these, numbered from 0; the 21 "
                           "scans are not: they begin with another number"),
            std::string::npos)
      << problem();
  write_scan(0, 0.0, false);
  EXPECT_NE(problem().find("scan 000021 belongs to no pose"), std::string::npos) << problem();
  std::filesystem::remove(folder_ / "000021.pcd");
  EXPECT_EQ(problem(), "");
  std::ofstream(folder_ / "000030.txt") << "something else";
  EXPECT_EQ(problem(), "");
  // All scans of a part of a recording may be there.
  EXPECT_TRUE(ScanFolder::open(folder_, {.first = 5, .recorded = 30}, odometry_, robot_));
}

TEST_F(Scans, MayHaveStampsOfTheirOwn) {
  ScanStamps times;
  for (int number = 0; number < 5; ++number) {
    times.stamps.push_back(odometry_[0].stamp + (0.213 + 0.13 * number));
    write_scan(number, 0.213 + 0.13 * number - kSweep_s, true);
  }
  const auto scans = ScanFolder::open(folder_, times, odometry_, robot_);
  ASSERT_TRUE(scans) << scans.error().message;
  for (std::size_t i = 0; i < 5; ++i) {
    const auto scan = (*scans)->scan(i);
    ASSERT_TRUE(scan && *scan);
    EXPECT_EQ((*scan)->stamp, times.stamps[i]);
    const Pose3 T = T_odom_body((*scan)->stamp - odometry_[0].stamp);
    for (std::size_t k = 0; k < kFixed.size(); ++k)
      EXPECT_LT((T * (*scan)->cloud->points[k].cast<double>() - kFixed[k]).norm(), 0.05);
  }
}

TEST_F(Scans, OneThatIsNotThereIsNamedInFull) {
  write_scan(3, 0.2, false);
  const auto scan = opened()->scan(2);
  ASSERT_FALSE(scan);
  EXPECT_EQ(scan.error().message, (folder_ / "000002.pcd").string() + " (or .bin): is not there");
}

}  // namespace scan_folder_test
}  // namespace tutti::mission
