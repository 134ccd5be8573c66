// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "tutti/formats/trajectory_file.hpp"
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include "support/formats/mutations.hpp"
#include "support/shared_data.hpp"

namespace tutti::formats {
namespace tum_test {

RC_GTEST_PROP(Tum, ReadsBackBitForBit, ()) {
  const Trajectory trajectory = internal::any_trajectory();
  RC_ASSERT(parse_tum(to_tum(trajectory), "t").value() == trajectory);
}

TEST(Tum, ColumnsAndExactStamps) {
  const auto trajectory =
      parse_tum("# comment\n1403636580.838555648 1 2 3 0.5 -0.5 0.5 0.5\n1403636580.838555649 4 5 6 0 0 0 1", "t");
  ASSERT_TRUE(trajectory);
  ASSERT_EQ(trajectory->size(), 2U);
  EXPECT_EQ((*trajectory)[0].stamp.ns, 1403636580838555648);
  EXPECT_EQ((*trajectory)[1].stamp.ns, 1403636580838555649);
  EXPECT_EQ((*trajectory)[0].pose.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ((*trajectory)[0].pose.rotation.coeffs(), Eigen::Vector4d(0.5, -0.5, 0.5, 0.5));
}

TEST(Tum, EmptyTextIsAnEmptyTrajectory) { EXPECT_TRUE(parse_tum("# nothing\n", "t").value().empty()); }

TEST(Tum, ErrorsSayWhereAndWhat) {
  const auto message = [](const char* text) {
    const auto result = parse_tum(text, "dir/run.tum");
    return result ? std::string("no error") : result.error().message;
  };
  EXPECT_EQ(message("1 0 0 0 0 0 0"), "dir/run.tum:1: row has 7 columns, expected 8 (stamp x y z qx qy qz qw)");
  EXPECT_EQ(message("\n1 0 0 0 0 0 0 1 9"), "dir/run.tum:2: row has 9 columns, expected 8 (stamp x y z qx qy qz qw)");
  EXPECT_EQ(message("soon 0 0 0 0 0 0 1"), "dir/run.tum:1: stamp in column 1 is 'soon', expected seconds");
  EXPECT_EQ(message("1 0 nan 0 0 0 0 1"), "dir/run.tum:1: column 3 is 'nan', expected a finite number");
  EXPECT_EQ(message("1 0 0 0 0 0 0 -inf"), "dir/run.tum:1: column 8 is '-inf', expected a finite number");
  EXPECT_EQ(message("1 0 0,5 0 0 0 0 1"), "dir/run.tum:1: column 3 is '0,5', expected a number");
  EXPECT_EQ(message("1 0 0 -1e300 0 0 0 1"),
            "dir/run.tum:1: position is (0, 0, -1e+300) m, expected at most 1e+09 m along each axis");
  EXPECT_EQ(message("1 0 0 1e9 0 0 0 1"), "no error");
  EXPECT_EQ(message("1 0 0 0 0 0 0 1.1"), "dir/run.tum:1: quaternion has norm 1.1, expected 1 within 0.01");
  EXPECT_EQ(
      message("2 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1"),
      "dir/run.tum:2: stamp 2.000000000 s does not come after the previous 2.000000000 s, expected increasing stamps");
  EXPECT_EQ(
      message("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1"),
      "dir/run.tum:2: stamp 1.000000000 s does not come after the previous 2.000000000 s, expected increasing stamps");
}

TEST(Tum, SurvivesAnyBytes) {
  internal::expect_survives<Trajectory>(
      "# t\n1.5 1 2 3 0.5 -0.5 0.5 0.5\n2.5 4 5 6 0 0 0 1\n3.25e1 -7 8e-3 9 0 0 1 0\n",
      [](const std::string& text, const std::string& name) { return parse_tum(text, name); },
      internal::is_sound_trajectory);
}

TEST(Tum, MissingFile) { EXPECT_EQ(read_trajectory("/no/such.tum").error().code, ErrorCode::io); }

TEST(Tum, WritesFiles) {
  const Trajectory trajectory = {{{-1}, {}}, {{5}, {Eigen::Quaterniond(0.6, 0, 0.8, 0), {0.1, -0.2, 1e-12}}}};
  const std::string path = testing::TempDir() + "tutti_tum_test.tum";
  ASSERT_TRUE(write_tum(path, trajectory));
  EXPECT_EQ(read_trajectory(path).value(), trajectory);
}

/// Pose counts of data/SOURCES-euroc-images-excavator.md.
TEST(Tum, RealFiles) {
  TUTTI_REQUIRE_SHARED("data/euroc");
  const std::vector<std::pair<std::string, std::size_t>> counts = {
      {"euroc/MH_01/groundtruth.tum", 36382},         {"euroc/MH_01/rpg_vio_mono.tum", 3659},
      {"euroc/MH_01/vinsmono_noloop.tum", 1749},      {"euroc/MH_02/groundtruth.tum", 29993},
      {"euroc/MH_02/rpg_vislam_rp1.tum", 2658},       {"euroc/MH_03/groundtruth.tum", 26302},
      {"euroc/MH_03/rpg_vio_mono.tum", 2564},         {"euroc/V1_01/groundtruth.tum", 2895},
      {"euroc/V1_01/rovioli_keyframes.tum", 152},     {"euroc/V1_02/openvins_mono.tum", 1618},
      {"excavator_mm/MM_04/rovio.tum", 1490},         {"excavator_mm/MM_05/m545_state.tum", 4533},
      {"excavator_mm/MM_05/rovio_DIVERGED.tum", 1379}};
  for (const auto& [file, count] : counts) {
    const auto trajectory = read_trajectory(test::shared_path("data/" + file));
    ASSERT_TRUE(trajectory) << trajectory.error().message;
    EXPECT_EQ(trajectory->size(), count) << file;
  }
  const auto first = read_trajectory(test::shared_path("data/euroc/MH_01/groundtruth.tum"));
  EXPECT_EQ(first->front().stamp.ns, 1403636580838555648);  // as text; the nearest double is another number
}

}  // namespace tum_test
}  // namespace tutti::formats
