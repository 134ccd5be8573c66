// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "tutti/formats/trajectory_file.hpp"
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <fstream>

#include "support/formats/mutations.hpp"
#include "support/shared_data.hpp"

namespace tutti::formats {
namespace euroc_csv_test {

constexpr const char* kGroundTruth =
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_x, v_y, v_z\n"
    "1403636580838555648,4.688319,-1.786938,0.783338,0.534108,-0.153029,-0.827383,-0.082152,-0.027876,0.033207,0."
    "800006\n"
    "1403636580843555328,4.688177,-1.786770,0.787350,0.534640,-0.152990,-0.826976,-0.082863,-0.029272,0.033992,0."
    "804771\n";

TEST(EurocCsv, ScalarFirstQuaternionsAndExactStamps) {
  const auto trajectory = parse_euroc_csv(kGroundTruth, "data.csv");
  ASSERT_TRUE(trajectory) << trajectory.error().message;
  ASSERT_EQ(trajectory->size(), 2U);
  EXPECT_EQ((*trajectory)[1].stamp.ns, 1403636580843555328);
  EXPECT_EQ((*trajectory)[0].pose.translation, Eigen::Vector3d(4.688319, -1.786938, 0.783338));
  EXPECT_NEAR((*trajectory)[0].pose.rotation.w(), 0.534108, 1e-6);
  EXPECT_NEAR((*trajectory)[0].pose.rotation.y(), -0.827383, 1e-6);
}

RC_GTEST_PROP(EurocCsv, SaysTheSameAsTum, ()) {
  const Trajectory trajectory = internal::any_trajectory();
  RC_ASSERT(parse_euroc_csv(to_euroc_csv(trajectory), "c").value() == trajectory);
}

TEST(EurocCsv, ErrorsSayWhereAndWhat) {
  const auto message = [](const char* text) {
    const auto result = parse_euroc_csv(text, "a.csv");
    return result ? std::string("no error") : result.error().message;
  };
  EXPECT_EQ(message("1,0,0,0,1,0,0"),
            "a.csv:1: row has 7 columns, expected at least 8 (stamp[ns],px,py,pz,qw,qx,qy,qz,...)");
  EXPECT_EQ(message("1,0,0,0,1,0,0,0,5\n2,0,0,0,1,0,0,0"),
            "a.csv:2: row has 8 columns, expected 9 (stamp[ns],px,py,pz,qw,qx,qy,qz,...)");
  EXPECT_EQ(message("1.5,0,0,0,1,0,0,0"), "a.csv:1: stamp in column 1 is '1.5', expected a 64-bit integer");
  EXPECT_EQ(message("1,0,,0,1,0,0,0"), "a.csv:1: column 3 is '', expected a number");
  EXPECT_EQ(message("1,0,0,0,2,0,0,0"), "a.csv:1: quaternion has norm 2, expected 1 within 0.001");
  EXPECT_EQ(message("9223372036854775807,0,0,0,1,0,0,0"),
            "a.csv:1: stamp is 9223372036854775807 ns, expected at most 2^61 either way");
}

TEST(EurocCsv, SurvivesAnyBytes) {
  internal::expect_survives<Trajectory>(kGroundTruth, parse_euroc_csv, internal::is_sound_trajectory);
}

TEST(EurocCsv, AnImuFileIsNotATrajectory) {
  TUTTI_REQUIRE_SHARED("data/euroc/MH_03/imu0.csv");
  const auto result = read_trajectory(test::shared_path("data/euroc/MH_03/imu0.csv"));
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find("imu0.csv:2: row has 7 columns"), std::string::npos) << result.error().message;
}

TEST(TrajectoryFile, RecognisesWhatItReads) {
  const std::string path = testing::TempDir() + "tutti_trajectory_file_test";
  const auto size_of = [&](const std::string& text) {
    std::ofstream(path) << text;
    const auto result = read_trajectory(path);
    return result ? static_cast<int>(result->size()) : -1;
  };
  EXPECT_EQ(size_of(kGroundTruth), 2);
  EXPECT_EQ(size_of("# t\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n3 0 0 0 0 0 0 1\n"), 3);
  EXPECT_EQ(size_of("1 0 0 5 0 1 0 6 0 0 1 7\n"), 1);
  EXPECT_EQ(size_of("1 0 0 5 0 1 0 6 0 0 1\n"), -1);
  EXPECT_EQ(size_of(""), 0);
  std::ofstream(path) << kGroundTruth;
  EXPECT_FALSE(read_trajectory(path, "tum"));
}

}  // namespace euroc_csv_test
}  // namespace tutti::formats
