// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/pcd.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include "support/shared_data.hpp"
#include "tutti/formats/internal/points.hpp"
#include "tutti/formats/testing/mutations.hpp"

namespace tutti::formats {
namespace {

PointCloud any_cloud() {
  PointCloud cloud;
  const int size = *rc::gen::inRange(0, 20);
  for (int i = 0; i < size; ++i)
    cloud.points.push_back(
        Eigen::Vector3d(internal::any_double(), internal::any_double(), internal::any_double()).cast<float>());
  return cloud;
}

std::string header(const std::string& fields, const std::string& sizes, const std::string& types,
                   const std::string& counts, std::size_t points, const std::string& data) {
  return fmt::format(
      "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\nWIDTH {}\n"
      "HEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {}\n",
      fields, sizes, types, counts, points, points, data);
}

RC_GTEST_PROP(Pcd, BinaryReadsBackBitForBit, ()) {
  const PointCloud cloud = any_cloud();
  RC_ASSERT(parse_pcd(to_pcd(cloud), "p").value() == cloud);
}

RC_GTEST_PROP(Pcd, AsciiSaysTheSameAsBinary, ()) {
  const PointCloud cloud = any_cloud();
  std::string text = header("i x y z", "4 4 4 4", "F F F F", "1 1 1 1", cloud.points.size(), "ascii");
  for (const auto& p : cloud.points) text += fmt::format("nan {} {} {}\n", p.x(), p.y(), p.z());
  RC_ASSERT(parse_pcd(text, "p").value() == cloud);
}

RC_GTEST_PROP(Pcd, CoordinatesAreFoundAmongAnyOtherFields, ()) {
  const PointCloud cloud = any_cloud();
  std::string bytes = header("t z label x y", "8 8 1 4 8", "F F U F F", "1 1 5 1 1", cloud.points.size(), "binary");
  for (const auto& p : cloud.points) {
    internal::put(bytes, 1e300);
    internal::put(bytes, static_cast<double>(p.z()));
    bytes += "\n#\xff\n ";
    internal::put(bytes, p.x());
    internal::put(bytes, static_cast<double>(p.y()));
  }
  RC_ASSERT(parse_pcd(bytes, "p").value() == cloud);
}

TEST(Pcd, DropsNonFinitePoints) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  const PointCloud cloud{{{1, 2, 3}, {nan, 0, 0}, {0, inf, 0}, {0, 0, -inf}, {4, 5, 6}}};
  EXPECT_EQ(parse_pcd(to_pcd(cloud), "p").value(), (PointCloud{{{1, 2, 3}, {4, 5, 6}}}));
  EXPECT_EQ(parse_pcd(header("x y z", "8 8 8", "F F F", "1 1 1", 3, "ascii") + "1 2 3\n1e300 0 0\nnan nan nan\n", "p")
                .value(),
            (PointCloud{{{1, 2, 3}}}));
}

TEST(Pcd, OrganisedCloudsHaveWidthTimesHeightPoints) {
  std::string text = header("x y z", "4 4 4", "F F F", "1 1 1", 2, "ascii") + "1 2 3\n4 5 6\n";
  text.replace(text.find("WIDTH 2\nHEIGHT 1"), 16, "WIDTH 1\nHEIGHT 2");
  EXPECT_EQ(parse_pcd(text, "p")->points.size(), 2U);
}

TEST(Pcd, ErrorsSayWhatIsWrong) {
  const auto message = [](const std::string& bytes) {
    const auto result = parse_pcd(bytes, "s.pcd");
    return result ? std::string("no error") : result.error().message;
  };
  const std::string good = to_pcd({{{1, 2, 3}, {4, 5, 6}}});
  EXPECT_EQ(message(good.substr(0, good.size() - 1)), "s.pcd: 23 bytes of data, expected 2 points of 12 bytes");
  EXPECT_EQ(message(good + "x"), "s.pcd: 25 bytes of data, expected 2 points of 12 bytes");
  EXPECT_EQ(message(""), "s.pcd: no DATA line, expected a PCD v0.7 header");
  EXPECT_EQ(message(header("x y z", "4 4 4", "F F F", "1 1 1", 2, "binary_compressed")),
            "s.pcd:11: DATA is 'binary_compressed', expected ascii or binary");
  EXPECT_EQ(message(header("x y", "4 4", "F F", "1 1", 0, "ascii")),
            "s.pcd: fields x, y and z expected, at least one is not there");
  EXPECT_EQ(message(header("x y z", "2 4 4", "I F F", "1 1 1", 0, "binary")),
            "s.pcd: field x is 1 x I2, expected one F4 or F8");
  EXPECT_EQ(message(header("x y z", "4 4", "F F F", "1 1 1", 0, "binary")),
            "s.pcd:4: SIZE has 2 entries, expected 3 as FIELDS");
  EXPECT_EQ(message(header("x y z", "4 4 4", "F F F", "1 1 1", 2, "ascii") + "1 2 3\n"),
            "s.pcd: ends after 1 points, expected 2 as its header says");
  EXPECT_EQ(message(header("x y z", "4 4 4", "F F F", "1 1 1", 1, "ascii") + "1 2\n"),
            "s.pcd:12: point has 2 columns, expected 3 as the header says");
  EXPECT_EQ(message(header("x y z", "4 4 4", "F F F", "1 1 1", 1, "ascii") + "1 2 3\n4 5 6\n"),
            "s.pcd:13: more lines than the 1 points of the header");
  EXPECT_EQ(message(header("x y z", "4 4 4", "F F F", "1 1 1", 4'000'000'000, "binary")),
            "s.pcd:7: WIDTH is 4000000000, expected 0 to 2147483648");
  EXPECT_EQ(parse_pcd(header("x y z", "4 4 4", "F F F", "1 1 1", 2, "binary_compressed"), "p").error().code,
            ErrorCode::unsupported);
}

TEST(Pcd, SurvivesAnyBytes) {
  const auto all_finite = [](const PointCloud& cloud) {
    return std::all_of(cloud.points.begin(), cloud.points.end(), [](const auto& p) { return p.allFinite(); });
  };
  internal::expect_survives<PointCloud>(to_pcd({{{1, 2, 3}, {4, 5, 6}}}), parse_pcd, all_finite);
  internal::expect_survives<PointCloud>(
      header("x y z i", "8 4 4 2", "F F F U", "1 1 1 3", 2, "ascii") + "1 2 3 0 0 0\n4 5 nan 7 8 9\n", parse_pcd,
      all_finite);
}

TEST(Pcd, RealScans) {
  TUTTI_REQUIRE_SHARED("data/lidar/hku_two_sessions");
  std::size_t files = 0;
  std::size_t points = 0;
  for (const std::string session : {"hku_session1", "hku_session2"})
    for (const auto& entry :
         std::filesystem::directory_iterator(test::shared_path("data/lidar/hku_two_sessions/" + session + "/Scans"))) {
      const auto cloud = read_pcd(entry.path());
      ASSERT_TRUE(cloud) << cloud.error().message;
      ++files;
      points += cloud->points.size();
      for (const auto& p : cloud->points) ASSERT_LT(p.norm(), 500.0F) << entry.path();
    }
  EXPECT_EQ(files, 314U + 266U);
  EXPECT_NEAR(static_cast<double>(points) / static_cast<double>(files), 5100.0, 300.0);  // SOURCES: about 5,100 each
}

TEST(Pcd, WritesFiles) {
  const PointCloud cloud{{{1, 2, 3}}};
  const std::string path = testing::TempDir() + "tutti_pcd_test.pcd";
  ASSERT_TRUE(write_pcd(path, cloud));
  EXPECT_EQ(read_pcd(path).value(), cloud);
}

}  // namespace
}  // namespace tutti::formats
