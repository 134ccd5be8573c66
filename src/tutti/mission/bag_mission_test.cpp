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

TEST_F(NamedBags, MissionFilesAreNoBags) {
  EXPECT_TRUE(is_mission_file("demo"));
  EXPECT_TRUE(is_mission_file("missions/hku.yaml"));
  EXPECT_FALSE(is_mission_file("recordings"));
}

}  // namespace bag_mission_test
}  // namespace tutti::mission
