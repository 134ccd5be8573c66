// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_verdict.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "support/bags/robot_bag.hpp"

namespace tutti::mission {
namespace bag_verdict_test {

using namespace bags::test;
namespace fs = std::filesystem;

constexpr Timestamp kStart{1'700'000'000'000'000'000};

class BagVerdicts : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / fmt::format("bag_verdict_{}", getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  /// Odometry and, unless `kind` says otherwise, scans and where the LiDAR is, of each robot with topics below this.
  void record(const std::vector<std::string>& robots, const std::string& kind = "") {
    std::vector<Sample> all;
    for (const std::string& of : robots) {
      const std::string body = of.empty() ? "base_link" : of.substr(1) + "/base_link", lidar = body + "_lidar";
      const std::string odom = of.empty() ? "odom" : of.substr(1) + "/odom";
      if (kind != "no transform")
        all.push_back(sample_of("/tf_static", kTf, kStart, tf_of(kStart, {{body, lidar, {}}})));
      for (int i = 0; i < 20; ++i) {
        const Timestamp stamp = kStart + 0.1 * i;
        if (kind != "no odometry")
          all.push_back(sample_of(of + "/odom", kOdometry, stamp,
                                  odometry_of(stamp, {Eigen::Quaterniond::Identity(), {0.1 * i, 0, 0}}, odom, body)));
        if (kind != "no scans")
          all.push_back(sample_of(of + "/points", kCloud, stamp,
                                  cloud_of(stamp + (kind == "another clock" ? -3600.0 : 0.0), lidar, {{1, 2, 3}})));
      }
    }
    std::ranges::stable_sort(all, {}, &Sample::ns);
    write_bytes(file(), mcap_of(all, "", 100));
  }
  [[nodiscard]] fs::path file() const { return folder_ / name_; }

  fs::path folder_;
  std::string name_ = "alpha.mcap";
};

TEST_F(BagVerdicts, OneThatIsReadyHasTheLineToType) {
  record({""});
  const BagVerdict verdict = judge_bag(file(), {});
  EXPECT_TRUE(verdict.is_ready);
  EXPECT_EQ(verdict.text, fmt::format("ready: tutti run --bag alpha={} --out out/alpha", file().string()));
  name_ = "two words.mcap";
  record({""});
  EXPECT_EQ(judge_bag(file(), {}).text,
            fmt::format("ready: tutti run --bag 'two_words={}' --out out/two_words", file().string()));
}

TEST_F(BagVerdicts, OneOfSeveralRobotsIsNamedForEach) {
  record({"/alpha", "/bravo"});
  EXPECT_EQ(judge_bag(file(), {"alpha", "bravo"}).text,
            fmt::format("ready: tutti run --bag alpha={0} --bag bravo={0} --out out/alpha", file().string()));
}

TEST_F(BagVerdicts, AFolderOfTwoRobotsBagsIsAskedAbout) {
  record({""});
  fs::copy_file(file(), folder_ / "bravo.mcap");
  const BagVerdict verdict = judge_bag(folder_, {});
  EXPECT_FALSE(verdict.is_ready);
  EXPECT_NE(verdict.text.find("are they one robot each? tutti run "), std::string::npos) << verdict.text;
  fs::rename(file(), folder_ / "bravo_1.mcap");  // files of one recording, by their names
  EXPECT_TRUE(judge_bag(folder_, {}).is_ready);
}

TEST_F(BagVerdicts, WhatRunWouldRefuseIsSaid) {
  const std::pair<const char*, const char*> cases[] = {
      {"no odometry", "no odometry: expected a topic of nav_msgs/Odometry"},
      {"no scans", "odometry alone merges no maps: no scans, and no images (no sensor_msgs/Image"},
      {"no transform", "--set robots.alpha.T_body_lidar"},
      {"another clock", "robots.alpha.scan_time_offset_s="}};
  for (const auto& [kind, said] : cases) {
    record({""}, kind);
    const BagVerdict verdict = judge_bag(file(), {});
    EXPECT_FALSE(verdict.is_ready) << kind;
    EXPECT_TRUE(verdict.text.starts_with("not ready: ")) << verdict.text;
    EXPECT_NE(verdict.text.find(said), std::string::npos) << verdict.text;
  }
}

}  // namespace bag_verdict_test
}  // namespace tutti::mission
