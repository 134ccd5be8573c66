// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/cloud_file.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "tutti/base/file.hpp"

namespace tutti::formats {
namespace cloud_file_test {

std::string file(const std::string& name, const std::string& content) {
  const std::string path = (std::filesystem::path(testing::TempDir()) / name).string();
  EXPECT_TRUE(write_file(path, content));
  return path;
}

TEST(CloudFile, IsToldByHowItBegins) {
  const std::vector<Eigen::Vector3f> points{{1, 2, 3}, {4, 5, 6}};
  const std::vector<std::string> comments{"frame: the map's world"};
  for (const CloudFormat format : {CloudFormat::ply, CloudFormat::pcd}) {
    const std::string path = file("cloud", "");
    ASSERT_TRUE(write_cloud(path, format, points, comments));
    EXPECT_NE(read_file(path).value().find(comments[0]), std::string::npos);
    const auto read = read_placed_cloud(path);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->cloud.points, points);
    EXPECT_EQ(read->origin, Eigen::Vector3d::Zero());
  }
}

// Floats have steps of 0.5 m there.
TEST(CloudFile, PcdFarFromTheOriginKeepsItsDigits) {
  const std::string header =
      "VERSION 0.7\nFIELDS x y z\nSIZE 8 8 8\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n";
  const auto read =
      read_placed_cloud(file("utm.pcd", header + "448000.13 5572000.30 310.07\n448001.13 5572000.80 310.07\n"));
  ASSERT_TRUE(read) << read.error().message;
  const Eigen::Vector3d first = read->origin + read->cloud.points[0].cast<double>();
  EXPECT_LT((first - Eigen::Vector3d(448000.13, 5572000.30, 310.07)).norm(), 1e-4);
  EXPECT_NEAR((read->cloud.points[1] - read->cloud.points[0]).y(), 0.5, 1e-4);
}

TEST(CloudFile, LasIsNamedWithTheWayOn) {
  const std::string path = file("survey.laz", "LASF\0\0");
  const auto read = read_placed_cloud(path);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::unsupported);
  EXPECT_NE(read.error().message.find("pdal translate " + path + " survey.ply"), std::string::npos)
      << read.error().message;
  const auto other = read_placed_cloud(file("points.xyz", "1 2 3\n"));
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().message.find("expected a PLY or PCD file"), std::string::npos) << other.error().message;
}

}  // namespace cloud_file_test
}  // namespace tutti::formats
