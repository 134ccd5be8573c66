// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "support/bags/rosbag2_writer.hpp"
#include "tutti/base/random.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/trajectory.hpp"

/// Messages of a robot with a LiDAR, for tests.
namespace tutti::bags::test {

inline void write_header(CdrWriter& out, Timestamp stamp, std::string_view frame) {
  out.header(frame, static_cast<std::int32_t>(stamp.ns / 1'000'000'000),
             static_cast<std::uint32_t>(stamp.ns % 1'000'000'000));
}
inline void write_pose(CdrWriter& out, const Pose3& pose) {
  for (const double value : pose.translation) out.number(value);
  for (const double value : pose.rotation.coeffs()) out.number(value);
}

/// `covariance`: of every element.
inline std::string odometry_of(Timestamp stamp, const Pose3& pose, std::string_view frame = "odom",
                               std::string_view child = "base_link", double covariance = 0.0, int how = 0) {
  CdrWriter out(how);
  write_header(out, stamp, frame);
  out.text(child);
  write_pose(out, pose);
  for (int i = 0; i < 36 + 6 + 36; ++i) out.number(covariance);
  return out.done();
}
inline std::string pose_stamped_of(Timestamp stamp, const Pose3& pose, std::string_view frame = "odom") {
  CdrWriter out;
  write_header(out, stamp, frame);
  write_pose(out, pose);
  return out.done();
}
/// {parent, child, T_parent_child}
inline std::string tf_of(Timestamp stamp, const std::vector<std::tuple<std::string, std::string, Pose3>>& transforms,
                         int how = 0) {
  CdrWriter out(how);
  out.number(static_cast<std::uint32_t>(transforms.size()));
  for (const auto& [parent, child, pose] : transforms) {
    write_header(out, stamp, parent);
    out.text(child);
    write_pose(out, pose);
  }
  return out.done();
}

struct CloudShape {
  bool big = false;            ///< Points only: is_bigendian.
  bool doubles = false;        ///< x, y, z are float64.
  std::string time_field;      ///< Empty: none.
  std::uint8_t time_type = 7;  ///< 6: uint32, 7: float32, 8: float64.
  double time_unit_s = 1.0;
  std::uint32_t rows = 1;
  std::uint32_t padding = 0;  ///< Bytes behind each row.
  std::string without;        ///< This coordinate is missing.
  int how = 0;                ///< CdrWriter
};

/// `times`: seconds of each point, after the stamp or by its clock, written in the shape's unit.
inline std::string cloud_of(Timestamp stamp, std::string_view frame, const std::vector<Eigen::Vector3f>& points,
                            const std::vector<double>& times = {}, const CloudShape& shape = {}) {
  const auto put = [&](std::string& to, auto value) {
    std::string bytes = little(value);
    if (shape.big) std::ranges::reverse(bytes);
    to += bytes;
  };
  std::vector<std::tuple<std::string, std::uint32_t, std::uint8_t>> fields;
  std::uint32_t step = 4;  // something else comes first
  for (const char* const name : {"x", "y", "z"}) {
    if (shape.without != name) fields.emplace_back(name, step, shape.doubles ? 8 : 7);
    step += shape.doubles ? 8 : 4;
  }
  if (!shape.time_field.empty()) {
    fields.emplace_back(shape.time_field, step, shape.time_type);
    step += shape.time_type == 8 ? 8 : 4;
  }
  const auto width = static_cast<std::uint32_t>(points.size() / shape.rows);
  std::string data;
  for (std::size_t i = 0; i < std::size_t{width} * shape.rows; ++i) {
    put(data, 7.5F);
    for (const float value : points[i])
      if (shape.doubles)
        put(data, double{value});
      else
        put(data, value);
    if (!shape.time_field.empty()) {
      const double time = times[i] / shape.time_unit_s;
      if (shape.time_type == 6)
        put(data, static_cast<std::uint32_t>(std::llround(time)));
      else if (shape.time_type == 7)
        put(data, static_cast<float>(time));
      else
        put(data, time);
    }
    if ((i + 1) % width == 0) data.append(shape.padding, '\xaa');
  }
  CdrWriter out(shape.how);
  write_header(out, stamp, frame);
  out.number(shape.rows).number(width).number(static_cast<std::uint32_t>(fields.size()));
  for (const auto& [name, offset, type] : fields) out.text(name).number(offset).number(type).number(std::uint32_t{1});
  out.number(static_cast<std::uint8_t>(shape.big ? 1 : 0)).number(step).number(step * width + shape.padding);
  return out.bytes(data).number(std::uint8_t{1}).done();
}

/// The same points and times as CustomMsg of a Livox, whose times are whole nanoseconds after the stamp.
inline std::string livox_of(Timestamp stamp, std::string_view frame, const std::vector<Eigen::Vector3f>& points,
                            const std::vector<double>& times, int how = 0) {
  std::vector<std::pair<std::uint32_t, std::array<float, 3>>> timed;
  for (std::size_t i = 0; i < points.size(); ++i)
    timed.push_back(
        {static_cast<std::uint32_t>(std::llround(1e9 * times[i])), {points[i].x(), points[i].y(), points[i].z()}});
  CdrWriter out(how);
  write_header(out, stamp, frame);
  return put_livox(out, timed).done();
}

inline Sample sample_of(std::string topic, std::string type, Timestamp stamp, std::string data) {
  return {std::move(topic), std::move(type), static_cast<std::uint64_t>(stamp.ns), std::move(data)};
}
inline const std::string kOdometry = "nav_msgs/msg/Odometry", kCloud = "sensor_msgs/msg/PointCloud2",
                         kLivox = "livox_ros_driver2/msg/CustomMsg", kOldLivox = "livox_ros_driver/msg/CustomMsg",
                         kTf = "tf2_msgs/msg/TFMessage", kPose = "geometry_msgs/msg/PoseStamped";

/// A recording of files as messages: odometry, and of each of its poses a scan of the folder.
inline std::vector<Sample> samples_of(const Trajectory& poses, const std::filesystem::path& scans, std::size_t count) {
  std::vector<Sample> out;
  for (std::size_t i = 0; i < std::min(count, poses.size()); ++i) {
    const auto& [stamp, pose] = poses[i];
    const auto cloud = formats::read_timed_pcd((scans / fmt::format("{:06d}.pcd", i)).string()).value();
    out.push_back(sample_of("/odometry", kOdometry, stamp, odometry_of(stamp, pose, "map", "body")));
    out.push_back(sample_of("/points", kCloud, stamp, cloud_of(stamp, "body", cloud.cloud.points)));
  }
  return out;
}

/// With a camera that looks at one picture, and an IMU that is turned by a quarter about z.
inline std::vector<Sample> with_camera(std::vector<Sample> samples, const Trajectory& odometry,
                                       const Pose3& T_base_camera, const std::string& encoding) {
  const Timestamp start = odometry.front().stamp;
  const Pose3 turned{Eigen::Quaterniond(std::sqrt(0.5), 0, 0, std::sqrt(0.5)), Eigen::Vector3d::Zero()};
  samples.push_back(sample_of("/tf_static", kTf, start,
                              tf_of(start, {{"base_link", "camera", T_base_camera}, {"base_link", "imu", turned}})));
  Rng rng(4);
  std::string pixels(160 * 120, '\0');
  for (char& pixel : pixels) pixel = static_cast<char>(rng.index(256));
  for (std::size_t i = 0; i < odometry.size(); i += 5) {
    const Timestamp stamp = odometry[i].stamp;
    CdrWriter image, info, imu;
    write_header(image, stamp, "camera");
    image.number(std::uint32_t{120}).number(std::uint32_t{160}).text(encoding);
    image.number(std::uint8_t{0}).number(std::uint32_t{160}).bytes(pixels);
    write_header(info, stamp, "camera");
    info.number(std::uint32_t{120}).number(std::uint32_t{160}).text("plumb_bob").number(std::uint32_t{0});
    for (const double k : {100.0, 0.0, 80.0, 0.0, 100.0, 60.0, 0.0, 0.0, 1.0}) info.number(k);
    info.numbers(9, 0.0).numbers(12, 0.0).numbers(6, std::uint32_t{0}).number(std::uint8_t{0});
    write_header(imu, stamp, "imu");
    imu.numbers(4, 0.0).numbers(9, 0.0).numbers(3, 1.0).numbers(9, 0.0).numbers(3, 4.0).numbers(9, 0.0);
    samples.push_back(sample_of("/camera/image_raw", "sensor_msgs/msg/Image", stamp, image.done()));
    samples.push_back(sample_of("/camera/camera_info", "sensor_msgs/msg/CameraInfo", stamp, info.done()));
    samples.push_back(sample_of("/imu", "sensor_msgs/msg/Imu", stamp, imu.done()));
  }
  return samples;
}

}  // namespace tutti::bags::test
