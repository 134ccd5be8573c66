// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/ply.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include "support/formats/mutations.hpp"
#include "tutti/formats/internal/points.hpp"

namespace tutti::formats {
namespace ply_test {

std::vector<Eigen::Vector3f> any_points() {
  std::vector<Eigen::Vector3f> points(*rc::gen::inRange<std::size_t>(0, 20));
  for (auto& p : points)
    p = Eigen::Vector3d(internal::any_double(), internal::any_double(), internal::any_double()).cast<float>();
  return points;
}

RC_GTEST_PROP(Ply, BinaryReadsBackBitForBit, ()) {
  const auto points = any_points();
  const std::vector<Rgb> colours(points.size(), Rgb{10, 35, 255});
  RC_ASSERT(parse_ply(to_ply(points), "p")->points == points);
  RC_ASSERT(parse_ply(to_ply(points, colours), "p")->points == points);
}

TEST(Ply, ColoursFollowTheirPoint) {
  const std::vector<Eigen::Vector3f> points = {{1, 2, 3}, {4, 5, 6}};
  const std::vector<Rgb> colours = {{1, 2, 3}, {253, 254, 255}};
  const std::string bytes = to_ply(points, colours);
  EXPECT_NE(bytes.find("property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"),
            std::string::npos);
  EXPECT_EQ(bytes.substr(bytes.size() - 3), "\xfd\xfe\xff");
  EXPECT_EQ(bytes.substr(bytes.size() - 18, 3), "\x01\x02\x03");
  EXPECT_THROW((void)to_ply(points, std::vector<Rgb>(1)), std::logic_error);
  const std::vector<std::string> comments{"frame: world", "end_header is no end here"};
  const std::string commented = to_ply(points, colours, {}, comments);
  EXPECT_NE(commented.find("comment frame: world\ncomment end_header is"), std::string::npos);
  EXPECT_EQ(parse_ply(commented, "p")->points, points);
}

TEST(Ply, FacesFollowTheVertices) {
  const std::vector<Eigen::Vector3f> vertices = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}, {1, 0, 1}};
  const std::vector<std::array<std::uint32_t, 3>> triangles = {{0, 1, 2}, {3, 2, 1}};
  const std::string bytes = to_ply(vertices, {}, triangles);
  EXPECT_NE(bytes.find("element face 2\nproperty list uchar int vertex_indices\nend_header\n"), std::string::npos);
  EXPECT_EQ(bytes.substr(bytes.size() - 13), std::string("\3\3\0\0\0\2\0\0\0\1\0\0\0", 13));
  EXPECT_EQ(parse_ply(bytes, "p")->points, vertices);
  EXPECT_THROW((void)to_ply(std::span(vertices).first(3), {}, triangles), std::logic_error);
}

TEST(Ply, AsciiWithFacesBehind) {
  const std::string text =
      "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 3\nproperty double z\nproperty uchar red\n"
      "property float y\nproperty float x\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
      "3 255 2 1\nnan 0 0 0\n6 0 5 4\n3 0 1 2\n";
  EXPECT_EQ(parse_ply(text, "p").value(), (PointCloud{{{1, 2, 3}, {4, 5, 6}}}));
}

TEST(Ply, SkipsPlainElementsInFront) {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement camera 2\nproperty double x\nproperty short k\nelement vertex 1\n"
      "property uchar tag\nproperty float x\nproperty double y\nproperty float z\nend_header\n";
  bytes += std::string(20, '\n');
  bytes += '\r';
  internal::put(bytes, 1.5F);
  internal::put(bytes, -2.5);
  internal::put(bytes, 3.5F);
  EXPECT_EQ(parse_ply(bytes, "p").value(), (PointCloud{{{1.5F, -2.5F, 3.5F}}}));
}

TEST(Ply, ErrorsSayWhatIsWrong) {
  const auto message = [](const std::string& bytes) {
    const auto result = parse_ply(bytes, "m.ply");
    return result ? std::string("no error") : result.error().message;
  };
  const std::string good = to_ply(std::vector<Eigen::Vector3f>{{1, 2, 3}});
  EXPECT_EQ(message(good.substr(0, good.size() - 1)), "m.ply: 11 bytes of data, expected 1 vertices of 12 bytes");
  EXPECT_EQ(message("plx"), "m.ply: does not begin with \"ply\", expected a PLY file");
  EXPECT_EQ(message("ply\nformat binary_big_endian 1.0\nend_header\n"),
            "m.ply: format is 'binary_big_endian', expected ascii or binary_little_endian");
  EXPECT_EQ(message("ply\nformat ascii 1.0\nend_header\n"), "m.ply: no element vertex in the header");
  EXPECT_EQ(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"),
            "m.ply: vertex properties x, y and z expected, at least one is not there");
  EXPECT_EQ(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty half x\n"),
            "m.ply:4: property type is 'half', expected a PLY type");
  EXPECT_EQ(message("ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar int x\nend_header\n"),
            "m.ply: vertices hold lists, expected plain numbers");
}

TEST(Ply, SurvivesAnyBytes) {
  const auto all_finite = [](const PointCloud& cloud) {
    return std::all_of(cloud.points.begin(), cloud.points.end(), [](const auto& p) { return p.allFinite(); });
  };
  internal::expect_survives<PointCloud>(to_ply(std::vector<Eigen::Vector3f>{{1, 2, 3}, {4, 5, 6}}), parse_ply,
                                        all_finite);
  internal::expect_survives<PointCloud>(
      "ply\nformat ascii 1.0\nelement k 1\nproperty int a\nelement vertex 2\nproperty float x\nproperty double y\n"
      "property float z\nend_header\n7\n1 2 3\n4 5 6\n",
      parse_ply, all_finite);
}

TEST(Ply, WritesFiles) {
  const std::vector<Eigen::Vector3f> points = {{1, 2, 3}};
  const std::string path = testing::TempDir() + "tutti_ply_test.ply";
  ASSERT_TRUE(write_ply(path, points));
  EXPECT_EQ(read_ply(path)->points, points);
  EXPECT_EQ(read_ply("/no/such.ply").error().code, ErrorCode::io);
}

TEST(Ply, ASurveyFarFromTheOriginKeepsItsDigits) {
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\nproperty double z\nend_header\n"
      "448000.131 5572000.302 310.07\n448001.132 5572000.802 310.08\n";
  const auto placed = parse_placed_ply(text, "s.ply");
  ASSERT_TRUE(placed) << placed.error().message;
  EXPECT_EQ(placed->origin, Eigen::Vector3d(448000, 5572000, 310));
  EXPECT_NEAR(placed->cloud.points[0].y(), 0.302, 1e-6);
  EXPECT_NEAR(placed->cloud.points[1].x(), 1.132, 1e-6);
  const auto near = parse_placed_ply(
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
      "property float z\nend_header\n1 2 3\n",
      "n.ply");
  EXPECT_EQ(near->origin, Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(near->cloud.points[0], Eigen::Vector3f(1, 2, 3));
}

}  // namespace ply_test
}  // namespace tutti::formats
