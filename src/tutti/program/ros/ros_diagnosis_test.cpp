// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/ros_diagnosis.hpp"

#include <gtest/gtest.h>

namespace tutti::ros {
namespace ros_diagnosis_test {

TEST(RosDiagnosis, DiagnosticsSayTheWorst) {
  RosSituation situation{.name = "alpha: live feed", .is_connected = true, .counts = {.odometry = 7}, .in_map = true};
  const auto expect = [&](int level, const std::string& message) {
    EXPECT_EQ(diagnosis(situation).level, level);
    EXPECT_EQ(diagnosis(situation).message, message);
  };
  expect(0, "fed, and on the map");
  situation.troubles = {"/alpha/points: holds no points"};
  expect(1, situation.troubles[0]);
  situation.alerts = {"odometry slipped"};
  expect(1, "odometry slipped");
  situation.is_connected = false;
  expect(2, "no robot program");
  EXPECT_EQ(diagnosis(situation).values.back(), std::pair(std::string("trouble 0"), situation.troubles[0]));
}

}  // namespace ros_diagnosis_test
}  // namespace tutti::ros
