// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "tutti/formats/trajectory_file.hpp"
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include <fstream>

#include "support/formats/mutations.hpp"
#include "support/shared_data.hpp"
#include "tutti/geometry/pose3.hpp"

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
  EXPECT_EQ(message("1.5,0,0,0,1,0,0,0"),
            "a.csv:1: stamp in column 1 is '1.5', expected a 64-bit integer (nanoseconds)");
  EXPECT_EQ(message("1,0,,0,1,0,0,0"), "a.csv:1: column 3 is '', expected a number");
  EXPECT_EQ(message("1,0,0,0,2,0,0,0"), "a.csv:1: quaternion has norm 2, expected 1 within 0.01");
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
  const auto by_names = read_trajectory(path, "tum");
  ASSERT_TRUE(by_names) << by_names.error().message;
  EXPECT_EQ(*by_names, parse_euroc_csv(kGroundTruth, "c").value());
  std::ofstream(path) << std::string(kGroundTruth).substr(std::string(kGroundTruth).find('\n') + 1);
  EXPECT_FALSE(read_trajectory(path, "tum"));  // w is first
}

/// Four poses as others write them, and the same read back.
class OthersTrajectories : public testing::Test {
 protected:
  Result<Trajectory> read(const std::string& text, const std::string& format = "auto") {
    report_ = {};
    std::ofstream(path_) << text;
    return read_trajectory(path_, format, 10.0, &report_);
  }
  void expect_turned(const std::string& text) {
    const auto read_back = read(text);
    ASSERT_TRUE(read_back) << text << read_back.error().message;
    ASSERT_EQ(read_back->size(), 1U) << text;
    EXPECT_EQ(read_back->front().stamp.ns, 1700000000500000000) << text;
    EXPECT_EQ(read_back->front().pose.translation, Eigen::Vector3d(1, 2, 3)) << text;
    EXPECT_LT(rotation_angle(read_back->front().pose.inverse() * Pose3{Eigen::Quaterniond(0.8, 0, 0, 0.6), {}}), 1e-9)
        << text;
  }
  std::string path_ = testing::TempDir() + "tutti_others_trajectories_test";
  RowReport report_;
};

TEST_F(OthersTrajectories, BadRowsAreLeftOutAndTheRestSorted) {
  const auto poses = read(
      "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n4 3 nan 0 0 0 0 1\n3 2 0 0 0 0 0 1\n2.5 2 0 0 0 0 0 1\n"
      "5 0 0 0 0 0 0 0\n6 5 0 0");
  ASSERT_TRUE(poses) << poses.error().message;
  ASSERT_EQ(poses->size(), 4U);
  EXPECT_EQ((*poses)[2].stamp.ns, 2500000000);
  EXPECT_EQ(report_.left_out.size(), 4U);
  EXPECT_EQ(report_.steps_back, 1U);
  ASSERT_EQ(report_.notes("f").size(), 2U);
  EXPECT_NE(report_.notes("f")[0].find("f: 4 rows left out, the first because: "), std::string::npos);
}

/// A covariance that only some rows have is behind the pose.
TEST_F(OthersTrajectories, RowsMayHaveMoreColumnsThanTheFirst) {
  for (const char* const text : {"1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1 0.1 0.2\n3 2 0 0 0 0 0 1\n",
                                 "1 0 0 0 0 0 0 1 0.1 0.2\n2 1 0 0 0 0 0 1\n3 2 0 0 0 0 0 1 0.1\n"}) {
    const auto poses = read(text);
    ASSERT_TRUE(poses) << poses.error().message;
    EXPECT_EQ(poses->size(), 3U) << text;
    EXPECT_TRUE(report_.left_out.empty()) << text;
  }
  const auto header_alone = read("timestamp,x,y,z,qx,qy,qz,qw\n");
  ASSERT_TRUE(header_alone) << header_alone.error().message;
  EXPECT_TRUE(header_alone->empty());
}

TEST_F(OthersTrajectories, StampsSeparatorsAndNames) {
  for (const char* text :
       {"1700000000.5,1,2,3,0,0,0.6,0.8\n", "1700000000.5, 1, 2, 3, 0, 0, 0.6, 0.8\n",
        "1700000000.5;1;2;3;0;0;0.6;0.8\n", "1700000000500000000 1 2 3 0 0 0.6 0.8\n",
        "1.7000000005e18 1 2 3 0 0 0.6 0.8\n", "1700000000500000 1 2 3 0 0 0.6 0.8\n",
        "1700000000500 1 2 3 0 0 0.6 0.8\n", "1700000000.5 1 2 3 0 0 0.6 0.8 17\n",
        "1700000000500000000,1,2,3,0.8,0,0,0.6\n",
        "timestamp,x,y,z,qw,qx,qy,qz\n1700000000500000000,1,2,3,0.8,0,0,0.6\n",
        "timestamp,x,y,z,qx,qy,qz,qw\n1700000000500000000,1,2,3,0,0,0.6,0.8\n",
        "#timestamp_kf,x,y,z,qw,qx,qy,qz\n1700000000500000000,1,2,3,0.8,0,0,0.6\n",
        "num, t, x, y, z, qx, qy, qz, qw\n7, 1700000000.5, 1, 2, 3, 0, 0, 0.6, 0.8\n",
        ",time,pos_x,pos_y,pos_z,quat_x,quat_y,quat_z,quat_w\n0,1700000000.5,1,2,3,0,0,0.6,0.8\n",
        "# sec,nsec,x,y,z,qx,qy,qz,qw\n1700000000,500000000,1,2,3,0,0,0.6,0.8\n",
        "timestamp x y z qw qx qy qz\n1700000000.5,1,2,3,0.8,0,0,0.6\n",
        "timestamp,x,y,z,qw,qx,qy,qz\n1700000000.5 1 2 3 0.8 0 0 0.6\n",
        "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.pose.pose.position.x,"
        "field.pose.pose.position.y,field.pose.pose.position.z,field.pose.pose.orientation.x,"
        "field.pose.pose.orientation.y,field.pose.pose.orientation.z,field.pose.pose.orientation.w,"
        "field.twist.twist.linear.x\n"
        "1700000009000000000,4,1700000000500000000,odom,1,2,3,0,0,0.6,0.8,5\n",
        "__time,/odom/pose/pose/position/x,/odom/pose/pose/position/y,/odom/pose/pose/position/z,"
        "/odom/pose/pose/orientation/x,/odom/pose/pose/orientation/y,/odom/pose/pose/orientation/z,"
        "/odom/pose/pose/orientation/w\n1700000000.5,1,2,3,0,0,0.6,0.8\n",
        "header.stamp.sec,header.stamp.nanosec,p.x,p.y,p.z,q.x,q.y,q.z,q.w\n"
        "1700000000,500000000,1,2,3,0,0,0.6,0.8\n",
        "# timestamp [ns], vertex, mission, p_G_I_x [m], p_G_I_y [m], p_G_I_z [m], q_G_I_w, q_G_I_x, "
        "q_G_I_y, q_G_I_z\n1700000000500000000, 3, a0, 1, 2, 3, 0.8, 0, 0, 0.6\n",
        "VehicleName\tTimeStamp\tPOS_X\tPOS_Y\tPOS_Z\tQ_W\tQ_X\tQ_Y\tQ_Z\tImageFile\n"
        "Drone\t1700000000500\t1\t2\t3\t0.8\t0\t0\t0.6\timg.png\n",
        "1700000000500000000,1,2,3,0.8,0,0,0.6,0,0,0,\n", "1700000000500000000.000000 1 2 3 0 0 0.6 0.8\n",
        "# timestamp(s) tx ty tz qx qy qz qw Pr11 Pr12\n# by OpenVINS\n"
        "1700000000.5 1 2 3 0 0 0.6 0.8 0.1 0.1\n",
        "Poses of a robot\ntime x y z qw qx qy qz\n1700000000.5 1 2 3 0.8 0 0 0.6\n",
        "time x y z qw qx qy qz\n1700000000.5 1 2 3 0.8 0 0 0.6\n",
        "1700000000.5 0.28 -0.96 0 1 0.96 0.28 0 2 0 0 1 3\n",
        "1700000000.5 1 2 3 0 0 0.594 0.792\n",  // of norm 0.99
        // seconds and nanoseconds, or the row's number, without names
        "1700000000 500000000 1 2 3 0 0 0.6 0.8\n", "1700000000, 500000000, 1, 2, 3, 0, 0, 0.6, 0.8\n",
        "4 1700000000.5 1 2 3 0 0 0.6 0.8\n",
        "1700000000.5 1 2 3 0 0 0.6 0.8\r"
        "# no line feeds\r",
        // spreadsheets, and countries whose numbers have commas
        "1700000000,5;1,0;2,0;3,0;0,0;0,0;0,6;0,8\n", "1700000000,5 1 2 3,0 0,0 0,0 0,6 0,8\n",
        "\"time\",\"x\",\"y\",\"z\",\"qx\",\"qy\",\"qz\",\"qw\"\n"
        "\"1700000000.5\",\"1\",\"2\",\"3\",\"0\",\"0\",\"0.6\",\"0.8\"\n",
        // ros2 topic echo --csv: Odometry, PoseStamped
        "1700000000,500000000,odom,base_link,1.0,2.0,3.0,0.0,0.0,0.6,0.8,0.0,0.0,0.0\n",
        "1700000000,500000000,odom,1.0,2.0,3.0,0.0,0.0,0.6,0.8\n",
        "# timestamp(s) q p v bg ba cam_imu_dt num_cam cam0_k\n1700000000.5 0 0 0.6 0.8 1 2 3 9 9 9 0 0 0 0 0 0 0.1 1 "
        "5\n",
        "1700000000.5 0.28 -0.96 0 1 0.96 0.28 0 2 0 0 1 3 0 0 0 1\n"})
    expect_turned(text);
  EXPECT_EQ(read("0.28 -0.96 0 1 0.96 0.28 0 2 0 0 1 3 0 0 0 1\n").value().front().pose.translation.z(), 3.0);
  read("1 0 0 0 0 0 0 1 5\n").value();
  EXPECT_EQ(report_.notes("f"), (std::vector<std::string>{"f: 1 columns beside stamp and pose are not read"}));
}

TEST_F(OthersTrajectories, NumberedRowsHaveARate) {
  const auto poses = read("0 1 0 0 0 0 1 0 0 0 0 1 0\n5 1 0 0 9 0 1 0 0 0 0 1 0\n");  // KITTI-360
  ASSERT_TRUE(poses) << poses.error().message;
  EXPECT_EQ(poses->back().stamp.ns, 500000000);
  EXPECT_EQ(report_.notes("f"), (std::vector<std::string>{"f: rows have no stamps, taken as 10 a second"}));
}

TEST_F(OthersTrajectories, StatedTumWithCommasCountsSeconds) {
  EXPECT_EQ(read("5,1,2,3,0,0,0.6,0.8\n", "tum").value().front().stamp.ns, 5000000000);
}

TEST_F(OthersTrajectories, StampsOfTooFewDigitsAreAnError) {
  const std::string many(
      "1.7e+09 0 0 0 0 0 0 1\n1.7e+09 1 0 0 0 0 0 1\n1.7e+09 2 0 0 0 0 0 1\n1.7e+09 3 0 0 0 0 0 1\n");
  const auto poses = read(many + "1.70001e+09 3 0 0 0 0 0 1\n");
  ASSERT_FALSE(poses);
  EXPECT_NE(poses.error().message.find("too few digits"), std::string::npos) << poses.error().message;
  EXPECT_NE(read(many).error().message.find("too few digits"), std::string::npos) << read(many).error().message;
}

TEST_F(OthersTrajectories, WhatIsNoTrajectoryIsCalledSo) {
  const auto expect = [&](const std::string& text, const std::string& part) {
    const auto poses = read(text);
    ASSERT_FALSE(poses) << text;
    EXPECT_NE(poses.error().message.find(part), std::string::npos) << poses.error().message;
    EXPECT_EQ(poses.error().message.find("state another format"), std::string::npos) << poses.error().message;
  };
  expect("#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n1 0.8 0 0 0.6 1 2 3 1 a.png\n10.0 20.0 -1\n",
         "it is COLMAP's images.txt");
  expect("header:\n  stamp:\n    sec: 17\n", "ros2 topic echo --csv");
  expect("timestamp,x,y,z,roll,pitch,yaw\n1.5,1,2,3,0,0,1\n", "its orientations are roll, pitch, yaw");
  expect("1.5 1 2 3\n2.5 1 2 3\n", "with 0 0 0 1 where no orientation is known");
  expect("t,x,y,yaw_rad\n1.5,1,2,0.1\n", "its orientation is a heading");
  expect("1.5 1 2 0.1\n", "sin(heading/2)");
  expect("1.5 1 2 3 0 0 90\n", "three angles");
  expect("2023-11-14T22:13:20.5 1 2 3 0 0 0.6 0.8\n", "its stamps are dates: write seconds since 1970");
  expect("1.5, [1, 2, 3], [0, 0, 0.6, 0.8]\n", "its numbers are in brackets");
  expect("\x89MCAP0\r\n", "is a recording, expected a trajectory: tutti bag info " + path_);
  expect("\x1f\x8b\x08\n", "is packed with gzip");
  expect(std::string("\xFF\xFE"
                     "1\0 \0",
                     6),
         "iconv -f UTF-16 -t UTF-8 '" + path_ + "'");
}

TEST_F(OthersTrajectories, OnePoseOfSeveralRowsIsNoTrajectory) {
  EXPECT_NE(read("2 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n").error().message.find(":2: stamp 2.000000000 s comes twice"),
            std::string::npos);
  EXPECT_NE(read("2 0 0 0 0 0 0 1\n3 nan 0 0 0 0 0 1\n").error().message.find(":2: column 2 is 'nan'"),
            std::string::npos);
}

TEST_F(OthersTrajectories, AnErrorSaysAsWhatItWasRead) {
  const auto message = [&](const std::string& format) { return read("1 2 3\n", format).error().message; };
  EXPECT_NE(message("auto").find(":1: row has 3 columns, expected 8"), std::string::npos) << message("auto");
  EXPECT_NE(message("auto").find("; recognised as tum: state another format"), std::string::npos) << message("auto");
  EXPECT_NE(message("kitti").find("; read as kitti: state another format"), std::string::npos) << message("kitti");
}

}  // namespace euroc_csv_test
}  // namespace tutti::formats
