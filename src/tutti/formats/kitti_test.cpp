// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/kitti.hpp"

#include <gtest/gtest.h>

#include "tutti/formats/trajectory_file.hpp"
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <limits>

#include "support/formats/mutations.hpp"
#include "support/shared_data.hpp"
#include "tutti/formats/internal/points.hpp"

namespace tutti::formats {
namespace kitti_test {

std::string row(const Pose3& pose, int digits) {
  const Eigen::Matrix4d m = pose.matrix();
  std::string out;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) out += fmt::format("{:.{}g}{}", m(i, j), digits, i == 2 && j == 3 ? '\n' : ' ');
  return out;
}

RC_GTEST_PROP(Kitti, RowsOfFewDigitsAreStillRotations, ()) {
  const Pose3 pose = internal::any_pose();
  const int digits = *rc::gen::elementOf(std::vector<int>{6, 17});
  const auto read = parse_kitti_poses(row(pose, digits), "k", 10.0, {});
  RC_ASSERT(read.has_value());
  RC_ASSERT(is_valid(read->front().pose, 1e-12));
  const double tolerance = digits == 6 ? 3e-6 : 1e-13;
  RC_ASSERT(rotation_angle(pose.inverse() * read->front().pose) < tolerance);
  RC_ASSERT((read->front().pose.translation - pose.translation).norm() <= tolerance * (1.0 + pose.translation.norm()));
}

RC_GTEST_PROP(Kitti, WrittenPosesReadBackButForRounding, ()) {
  const Trajectory trajectory = internal::any_trajectory();
  const auto read = parse_kitti_poses(to_kitti_poses(trajectory), "k", 10.0, {});
  RC_ASSERT(read.has_value() && read->size() == trajectory.size());
  for (std::size_t i = 0; i < read->size(); ++i) {
    RC_ASSERT((*read)[i].pose.translation == trajectory[i].pose.translation);
    RC_ASSERT(rotation_angle(trajectory[i].pose.inverse() * (*read)[i].pose) < 1e-7);
  }
}

TEST(Kitti, WrittenScansReadBackBitForBit) {
  const PointCloud cloud{{{1.5F, -2.0F, 3e-7F}, {0.1F, 1e9F, -0.0F}}};
  EXPECT_EQ(parse_kitti_scan(to_kitti_scan(cloud.points), "k").value(), cloud);
}

TEST(Kitti, RowMajorAndStampsFromTheRate) {
  const auto poses = parse_kitti_poses("0 -1 0 5 1 0 0 6 0 0 1 7\n1 0 0 1 0 1 0 2 0 0 1 3\n", "k", 10.0, {1'000});
  ASSERT_TRUE(poses);
  EXPECT_TRUE(((*poses)[0].pose * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(5, 7, 7)));
  EXPECT_EQ((*poses)[0].stamp.ns, 1'000);
  EXPECT_EQ((*poses)[1].stamp.ns, 100'001'000);
}

TEST(Kitti, ErrorsSayWhereAndWhat) {
  const auto message = [](const char* text, double rate_hz = 10.0) {
    const auto result = parse_kitti_poses(text, "k.txt", rate_hz, {});
    return result ? std::string("no error") : result.error().message;
  };
  EXPECT_EQ(message("1 0 0 0 0 1 0 0 0 0 1"), "k.txt:1: row has 11 columns, expected 12 (row-major 3x4 matrix [R t])");
  EXPECT_EQ(message("1 0 0 0 0 1 0 0 0 0 1 nan"), "k.txt:1: column 12 is 'nan', expected a finite number");
  EXPECT_EQ(message("1.01 0 0 0 0 1 0 0 0 0 1 0"),
            "k.txt:1: |R^T R - I| is 0.0201, det R 1.01, expected a rotation within 0.001");
  EXPECT_EQ(message("-1 0 0 0 0 1 0 0 0 0 1 0"),
            "k.txt:1: |R^T R - I| is 0, det R -1, expected a rotation within 0.001");
  for (const double rate_hz : {0.0, -1.0, 1e-9, 1e9, std::numeric_limits<double>::quiet_NaN()})
    EXPECT_NE(message("", rate_hz), "no error") << rate_hz;
}

TEST(Kitti, SurvivesAnyBytes) {
  internal::expect_survives<Trajectory>(
      "0 -1 0 5 1 0 0 6 0 0 1 7\n1 0 0 1 0 1 0 2 0 0 1 3\n",
      [](const std::string& text, const std::string& name) { return parse_kitti_poses(text, name, 10.0, {}); },
      internal::is_sound_trajectory);
  internal::expect_survives<std::vector<Timestamp>>("1.5\n2.25e0\n1000\n", parse_times, [](const auto& times) {
    return std::adjacent_find(times.begin(), times.end(), std::greater_equal<>()) == times.end();
  });
}

TEST(Kitti, TimesReplaceStamps) {
  const auto poses = parse_kitti_poses("1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 1 0 1 0 0 0 0 1 0\n", "k", 10.0, {});
  const auto times = parse_times("1577836980.0991046\n1577836980.5\n", "times.txt");
  const auto stamped = with_times(*poses, *times);
  ASSERT_TRUE(stamped);
  EXPECT_EQ((*stamped)[0].stamp.ns, 1577836980099104600);
  EXPECT_EQ((*stamped)[1].pose, (*poses)[1].pose);
  EXPECT_FALSE(with_times(*poses, std::vector<Timestamp>{{1}}));
  EXPECT_FALSE(with_times(*poses, std::vector<Timestamp>{{1}, {1}}));
  EXPECT_EQ(parse_times("1\n1\n", "times.txt").error().message,
            "times.txt:2: stamp 1.000000000 s does not come after the previous 1.000000000 s");
}

/// Pose counts of data/SOURCES-lidar-kitti-graphs-bags.md.
TEST(Kitti, ATransformIsFourRowsOfARigidMotion) {
  const auto turned = parse_transform("# of two sessions\n0 -1 0 1\n1 0 0 2  # turned\n\n0 0 1 3\n0 0 0 1\n", "t");
  ASSERT_TRUE(turned) << turned.error().message;
  EXPECT_EQ(turned->translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_NEAR(turned->rotation.toRotationMatrix()(1, 0), 1.0, 1e-12);
  const auto problem = [](const std::string& text) {
    const auto pose = parse_transform(text, "t.txt");
    return pose ? "" : pose.error().message;
  };
  const std::string zeros = "0 0 0 0\n";
  EXPECT_EQ(problem("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"), "");
  EXPECT_EQ(problem(zeros + zeros + zeros + zeros),
            "t.txt:3: |R^T R - I| is 1, det R 0, expected a rotation within 0.001");
  EXPECT_EQ(problem("2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n").find("t.txt:3: |R^T R - I| is 3"), 0U);
  EXPECT_EQ(problem("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n").find("t.txt:3: |R^T R - I| is 0, det R -1"), 0U);
  EXPECT_EQ(problem("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 2\n"), "t.txt:4: last row is 0 0 0 2, expected 0 0 0 1");
  EXPECT_EQ(problem("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\nand more\n").find("t.txt:5: a fifth row"), 0U);
  EXPECT_EQ(problem("1 0 0 0\n0 1 0 1e300\n0 0 1 0\n0 0 0 1\n").find("t.txt:4: position is (0, 1e+300, 0)"), 0U);
  EXPECT_EQ(problem("1 0 0 0 m\n").find("t.txt:1: row has 5 columns"), 0U);
  EXPECT_EQ(problem("1 0 0 0\n0 nan 0 0\n").find("t.txt:2: column 2"), 0U);
  EXPECT_EQ(problem("1 0 0 0\n0 1 0 0\n"), "t.txt: 2 rows, expected the 4 of a 4x4 transform");
}

TEST(Kitti, ScansAreFourFloatsAPoint) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::string bytes;
  for (const float value : {1.0F, 2.0F, 3.0F, 0.5F, nan, 0.0F, 0.0F, 0.5F, 4.0F, 5.0F, 6.0F, nan})
    internal::put(bytes, value);
  EXPECT_EQ(parse_kitti_scan(bytes, "s.bin").value(), (PointCloud{{{1, 2, 3}, {4, 5, 6}}}));
  EXPECT_EQ(parse_kitti_scan(bytes + "x", "s.bin").error().message,
            "s.bin: 49 bytes, expected 16 for every point (x, y, z, intensity)");
  internal::expect_survives<PointCloud>(bytes, parse_kitti_scan, [](const PointCloud& cloud) {
    return std::ranges::all_of(cloud.points, [](const auto& p) { return p.allFinite(); });
  });
}

TEST(Kitti, RealFiles) {
  TUTTI_REQUIRE_SHARED("data/kitti");
  const std::vector<std::pair<std::string, std::size_t>> counts = {
      {"00", 4541}, {"02", 4661}, {"05", 2761}, {"07", 1101}};
  for (const auto& [sequence, count] : counts)
    for (const std::string folder : {"gt_poses", "lidar_odometry_simple_online"}) {
      const auto poses = read_trajectory(test::shared_path("data/kitti/" + folder + "/" + sequence + ".txt"));
      ASSERT_TRUE(poses) << poses.error().message;
      EXPECT_EQ(poses->size(), count);
    }
}

TEST(Kitti, RealFastLio2Recordings) {
  TUTTI_REQUIRE_SHARED("data/lidar/hku_two_sessions");
  const std::vector<std::pair<std::string, std::size_t>> counts = {{"hku_session1", 314}, {"hku_session2", 266}};
  for (const auto& [session, count] : counts) {
    const auto folder = test::shared_path("data/lidar/hku_two_sessions/" + session);
    const auto poses = read_trajectory(folder / "odom_poses.txt");
    const auto times = read_times(folder / "times.txt");
    ASSERT_TRUE(poses) << poses.error().message;
    ASSERT_TRUE(times) << times.error().message;
    EXPECT_EQ(poses->size(), count);
    EXPECT_TRUE(with_times(*poses, *times));
  }
}

}  // namespace kitti_test
}  // namespace tutti::formats
