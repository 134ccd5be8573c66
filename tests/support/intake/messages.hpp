// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "support/bags/bag_writer.hpp"
#include "tutti/bags/ros_encode.hpp"
#include "tutti/geometry/pose3.hpp"

/// Messages of a robot's, as bytes.
namespace tutti::intake::test {

inline constexpr std::int64_t kSecond = 1'000'000'000;
inline constexpr std::int64_t kStart = 1'700'000'000 * kSecond;
inline constexpr std::int64_t kPeriod = kSecond / 10;

inline std::string odometry(std::int64_t ns, double x = 0.0, const std::string& odom = "odom",
                            const std::string& body = "base_link") {
  return bags::encode(
      bags::RosOdometry{.header = {{ns}, odom}, .child_frame_id = body, .pose = {{x, 0, 0}}, .pose_covariance = {}});
}

inline std::string transform(std::int64_t ns, const std::string& parent, const std::string& child, const Pose3& T) {
  const bags::RosTransform out{
      .header = {{ns}, parent}, .child_frame_id = child, .translation = T.translation, .rotation = T.rotation};
  return bags::encode(std::span(&out, 1));
}

/// One point in front, measured `time_s` after the stamp, and others so that it is a sweep.
inline std::string points(std::int64_t ns, const std::vector<float>& times, const std::string& frame = "base_link") {
  std::vector<float> numbers;
  for (const float time : times) numbers.insert(numbers.end(), {5.0F, 0.0F, 0.0F, time});
  const std::string_view data(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float));
  const auto count = static_cast<std::uint32_t>(times.size());
  return bags::encode(
      bags::RosPointCloud{.header = {{ns}, frame},
                          .height = 1,
                          .width = count,
                          .fields = {{"x", 0, 7, 1}, {"y", 4, 7, 1}, {"z", 8, 7, 1}, {"time", 12, 7, 1}},
                          .point_step = 16,
                          .row_step = 16 * count,
                          .data = data,
                          .is_dense = true});
}
/// Three points of a Livox, of which the first is measured at the stamp, 5 m in front, the last 0.1 s later.
inline std::string livox(std::int64_t ns, const std::string& frame = "base_link") {
  bags::test::CdrWriter out;
  out.header(frame, static_cast<std::int32_t>(ns / kSecond), static_cast<std::uint32_t>(ns % kSecond));
  return bags::test::put_livox(out, {{0, {5, 0, 0}}, {50'000'000, {5, 1, 0}}, {100'000'000, {5, 2, 0}}}).done();
}
/// As of a receiver that knows its place to 1 m.
inline std::string fix(std::int64_t ns, const std::string& frame = "base_link", double latitude_deg = 46.5) {
  bags::RosNavSatFix out = bags::to_ros({{ns}, frame}, {latitude_deg, 7.9, 600.0});
  for (const std::size_t i : {0U, 4U, 8U}) out.position_covariance[i] = 1.0;
  out.position_covariance_type = 2;
  return bags::encode(out);
}
/// As of a radio; with limits where `most_m` is not 0.
inline std::string range(std::int64_t ns, float range_m, const std::string& frame, float most_m = 50.0F) {
  bags::test::CdrWriter out;
  out.header(frame, static_cast<std::int32_t>(ns / kSecond), static_cast<std::uint32_t>(ns % kSecond));
  return out.number(std::uint8_t{0}).number(0.1F).number(0.0F).number(most_m).number(range_m).number(0.01F).done();
}
/// A grey image of 4 x 3 pixels, and the calibration of its camera.
inline bags::RosImage grey_image(std::int64_t ns, const std::string& frame = "camera") {
  bags::RosImage out{.header = {{ns}, frame}, .height = 3, .width = 4, .encoding = "mono8", .step = 4};
  out.data = "abcdefghijkl";
  return out;
}
inline bags::RosCameraInfo calibration(std::uint32_t width = 4, std::uint32_t height = 3) {
  bags::RosCameraInfo out;
  out.header.frame_id = "camera";
  out.height = height;
  out.width = width;
  out.distortion_model = "plumb_bob";
  out.d = {0, 0, 0, 0, 0};
  out.k = {3, 0, 2, 0, 3, 1.5, 0, 0, 1};
  return out;
}
/// The same camera's depth: 1280 mm everywhere (two bytes, 0 and 5).
inline bags::RosImage depth_image(std::int64_t ns, const std::string& frame = "camera") {
  static const std::string bytes = [] {
    std::string out;
    for (int i = 0; i < 12; ++i) out += std::string("\0\5", 2);
    return out;
  }();
  return {.header = {{ns}, frame}, .height = 3, .width = 4, .encoding = "16UC1", .step = 8, .data = bytes};
}
inline std::string imu(std::int64_t ns, const Eigen::Vector3d& gyro = {1, 2, 3}, const std::string& frame = "imu") {
  return bags::encode(
      bags::RosImu{.header = {{ns}, frame}, .angular_velocity = gyro, .linear_acceleration = {4, 5, 6}});
}
inline const std::vector<float> kAtOnce{0.0F};
inline const std::vector<float> kSweepBefore{-0.1F, -0.05F, 0.0F}, kSweepAfter{0.0F, 0.05F, 0.09F};

}  // namespace tutti::intake::test
