// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "support/intake/messages.hpp"
#include "tutti/intake/images_intake.hpp"

namespace tutti::intake::test {

inline std::string why(const Status& status) { return status ? "" : status.error().message; }
inline void expect(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
}

inline CameraTopics topics_of(const std::string& camera, Wish wish = Wish::nothing) {
  return {camera + "/image_raw", camera + "/camera_info", false, true, wish};
}
inline const CameraTopics kLeft = topics_of("/r/left"), kRight = topics_of("/r/right"), kDepth = topics_of("/r/depth");
inline const Pose3 kBodyCamera{Eigen::Quaterniond::Identity(), {0.1, 0.2, 0.3}};
inline const Pose3 kBodyImu{Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ())), {0, 0, 0}};

/// A robot whose odometry runs at 10 Hz, and its cameras.
struct CameraRobot {
  explicit CameraRobot(std::vector<CameraTopics> cameras = {kLeft}, const std::string& imu_topic = "/r/imu",
                       ImagesConfig config = {})
      : images(std::move(config), std::move(cameras), imu_topic, odometry_) {}
  void place() {
    EXPECT_TRUE(odometry_.add_tf(transform(0, "base_link", "camera", kBodyCamera), true));
    EXPECT_TRUE(odometry_.add_tf(transform(0, "base_link", "imu", kBodyImu), true));
  }
  /// Feeds odometry up to and including sample `i`.
  Timestamp go(int i) {
    for (; next_ <= i; ++next_) {
      EXPECT_TRUE(odometry_.add_odometry(odometry(kStart + next_ * kPeriod)));
      EXPECT_TRUE(odometry_.next_odometry(false));
    }
    return {kStart + i * kPeriod};
  }
  Sensors sensors(bool is_late = false) {
    const auto chosen = images.choose(is_late);
    EXPECT_TRUE(chosen) << chosen.error().message;
    Sensors out;
    images.describe(out);
    return out;
  }
  RosIntake odometry_{{}};
  ImagesIntake images;

 private:
  int next_ = 0;
};

}  // namespace tutti::intake::test
