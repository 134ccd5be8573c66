// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/imu_file.hpp"

#include <gtest/gtest.h>

#include "support/formats/mutations.hpp"
#include "support/shared_data.hpp"

namespace tutti::formats {
namespace imu_file_test {

constexpr const char* kTwoSamples =
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y,w_RS_S_z,a_RS_S_x [m s^-2],a_RS_S_y,a_RS_S_z\n"
    "1403715273262142976,-0.002,0.017,0.077,9.087,0.130,-3.693\r\n"
    "1403715273267142912,-0.001,0.019,0.078,9.079,0.122,-3.694\n";

TEST(ImuFile, GyroThenAccelerometer) {
  const auto samples = parse_imu_csv(kTwoSamples, "data.csv");
  ASSERT_TRUE(samples) << samples.error().message;
  ASSERT_EQ(samples->size(), 2U);
  EXPECT_EQ((*samples)[0].stamp.ns, 1403715273262142976);
  EXPECT_EQ((*samples)[0].gyro, Eigen::Vector3d(-0.002, 0.017, 0.077));
  EXPECT_EQ((*samples)[1].accelerometer, Eigen::Vector3d(9.079, 0.122, -3.694));
}

TEST(ImuFile, ErrorsSayWhereAndWhat) {
  const auto message = [](const char* text) {
    const auto result = parse_imu_csv(text, "a.csv");
    return result ? std::string("no error") : result.error().message;
  };
  EXPECT_EQ(message("1,0,0,0,0,0"), "a.csv:1: row has 6 columns, expected 7 (stamp[ns],wx,wy,wz,ax,ay,az)");
  EXPECT_EQ(message("1,0,0,0,0,0,0\n1,0,0,0,0,0,0"),
            "a.csv:2: stamp 1 ns does not come after the previous 1 ns, expected increasing stamps");
  EXPECT_EQ(message("1,0,nan,0,0,0,0"), "a.csv:1: column 3 is 'nan', expected a finite number");
  EXPECT_EQ(message("1,0,0,2000,0,0,0"), "a.csv:1: column 4 is 2000, expected at most 1000 rad/s either way");
  EXPECT_EQ(message("1,0,0,0,0,0,1e6"), "a.csv:1: column 7 is 1000000, expected at most 100000 m/s^2 either way");
  EXPECT_FALSE(read_imu_csv("/nowhere/imu.csv"));
}

TEST(ImuFile, SurvivesAnyBytes) {
  internal::expect_survives<std::vector<ImuSample>>(kTwoSamples, parse_imu_csv, [](const auto& samples) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (!samples[i].gyro.allFinite() || !samples[i].accelerometer.allFinite()) return false;
      if (i > 0 && samples[i].stamp <= samples[i - 1].stamp) return false;
    }
    return true;
  });
}

TEST(ImuFile, ReadsARealOne) {
  TUTTI_REQUIRE_SHARED("data/euroc/V1_01/imu0.csv");
  const auto samples = read_imu_csv(test::shared_path("data/euroc/V1_01/imu0.csv"));
  ASSERT_TRUE(samples) << samples.error().message;
  ASSERT_EQ(samples->size(), 29120U);
  EXPECT_NEAR((samples->back().stamp - samples->front().stamp) / 29119.0, 0.005, 1e-5);
  EXPECT_NEAR(samples->front().accelerometer.norm(), 9.81, 0.1);  // at rest
}

}  // namespace imu_file_test
}  // namespace tutti::formats
