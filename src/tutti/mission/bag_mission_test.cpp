// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/bag_mission.hpp"

#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace tutti::mission {
namespace bag_mission_test {

namespace fs = std::filesystem;

class NamedBags : public testing::Test {
 protected:
  ~NamedBags() override { fs::remove_all(data_); }
  void make(const std::string& file) const {
    fs::create_directories((data_ / file).parent_path());
    std::ofstream(data_ / file) << "x";
  }
  [[nodiscard]] std::string named(const std::vector<std::string>& inputs) const {
    const auto out = name_bags(inputs, data_);
    return out ? fmt::format("{}", fmt::join(*out, " ")) : out.error().message;
  }
  fs::path data_ = fs::path(testing::TempDir()) / fmt::format("named_bags_{}", getpid());
};

TEST_F(NamedBags, FilesAndFoldersOfRosbag2AreRobotsByTheirNames) {
  make("a.mcap");
  make("b.run.mcap");
  make("rec/a/a_0.mcap");
  make("rec/a/metadata.yaml");
  EXPECT_EQ(named({"a.mcap", "b.run.mcap", "rec/a"}), "a=a.mcap b=b.run.mcap a_2=rec/a");
  make("rec/b/b_0.db3");
  EXPECT_EQ(named({"rec"}), "a=rec/a b=rec/b");
  make("parts/run_0.mcap");
  make("parts/run_1.mcap");
  EXPECT_EQ(named({"parts"}), "parts=parts");
}

TEST_F(NamedBags, AFolderOfTwoRobotsBagsIsAskedAbout) {
  make("rec/a.mcap");
  make("rec/b.mcap");
  const std::string a = (data_ / "rec/a.mcap").string(), b = (data_ / "rec/b.mcap").string();
  EXPECT_NE(named({"rec"}).find("holds 2 bags and no metadata.yaml: are they one robot each? tutti run " + a + " " + b),
            std::string::npos)
      << named({"rec"});
  EXPECT_NE(named({"rec"}).find("tutti run --bag rec="), std::string::npos) << named({"rec"});
  make("rec/metadata.yaml");
  EXPECT_EQ(named({"rec"}), "rec=rec");
  fs::create_directories(data_ / "none");
  EXPECT_NE(named({"none"}).find("holds no bag"), std::string::npos);
  EXPECT_NE(named({"nowhere"}).find("is not there"), std::string::npos);
  make("desk/rgb.txt");
  EXPECT_NE(named({"desk"}).find("images: {list: " + (data_ / "desk/rgb.txt").string() +
                                 ", cameras: CAMERAS.yaml, "
                                 "depth: {list: " +
                                 (data_ / "desk/depth.txt").string() + "}}"),
            std::string::npos)
      << named({"desk"});
}

TEST_F(NamedBags, RecordingsInFilesOfTheirOwnAreNamedWithTheRobotThatReadsThem) {
  const auto expect = [&](const std::string& folder, const std::string& what, const std::string& robot) {
    EXPECT_NE(named({folder}).find(what), std::string::npos) << named({folder});
    EXPECT_NE(named({folder}).find(robot), std::string::npos) << named({folder});
    EXPECT_EQ(named({folder}), (data_ / folder).string() + ": " + known_folder(data_ / folder));
  };
  make("MH_01/mav0/cam0/data.csv");
  const std::string euroc = (data_ / "MH_01").string();
  expect("MH_01", "is a recording as EuRoC's (ASL's), which `tutti run` takes by a mission file",
         "robots: [{name: MH_01, odometry: {file: ODOMETRY.tum}, images: {euroc_folder: " + euroc + "}}]");
  expect("MH_01/mav0", "is a recording as EuRoC's (ASL's)", "images: {euroc_folder: " + euroc + "/mav0}}]");
  make("kitti/sequences/00/velodyne/000000.bin");
  const std::string kitti = (data_ / "kitti/sequences/00").string();
  expect("kitti", "is KITTI's odometry data set",
         "odometry: {file: POSES.txt, format: kitti, times: " + kitti + "/times.txt}, scans: " + kitti + "/velodyne}]");
  expect("kitti/sequences/00", "is a sequence as KITTI's", "closures: {verifier: lidar}");
  make("hku/Scans/000000.pcd");
  expect("hku", "is a recording as HKU's", "scans: " + (data_ / "hku/Scans").string());
  expect("hku/Scans", "is a folder of scans", "scans: " + (data_ / "hku/Scans").string());
  make("out/demo/report.json");
  expect("out/demo", "is what tutti run has written", "tutti export " + (data_ / "out/demo").string());
  make("recs/a/a_0.mcap");
  EXPECT_EQ(known_folder(data_ / "recs"), "holds bags in folders of their own: " + (data_ / "recs/a").string());
  make("other/a.tum");
  make("other/b.tum");
  EXPECT_NE(named({"other"}).find("holds no bag, expected .mcap"), std::string::npos) << named({"other"});
  EXPECT_NE(named({"other"}).find("here: 2 .tum"), std::string::npos) << named({"other"});
}

TEST_F(NamedBags, MissionFilesAreNoBags) {
  EXPECT_TRUE(is_mission_file("demo"));
  EXPECT_TRUE(is_mission_file("missions/hku.yaml"));
  EXPECT_FALSE(is_mission_file("recordings"));
}

}  // namespace bag_mission_test
}  // namespace tutti::mission
