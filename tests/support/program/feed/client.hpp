// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/v1/feed.pb.h"

/// The client's end of a live feed.
namespace tutti::program::test {

inline std::string framed(const v1::Feed& message) {
  const std::string payload = message.SerializeAsString();
  std::string out(4, '\0');
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<char>(payload.size() >> (8 * i) & 0xffU);
  return out + payload;
}

inline void write(const Pose3& T, v1::Feed::Pose& out) {
  out.set_x(T.translation.x());
  out.set_y(T.translation.y());
  out.set_z(T.translation.z());
  out.set_qx(T.rotation.x());
  out.set_qy(T.rotation.y());
  out.set_qz(T.rotation.z());
  out.set_qw(T.rotation.w());
}
inline Pose3 read(const v1::Feed::Pose& in) {
  return {Eigen::Quaterniond(in.qw(), in.qx(), in.qy(), in.qz()), {in.x(), in.y(), in.z()}};
}

inline std::string hello(bool listens_only = false, std::uint32_t version = kFeedVersion) {
  v1::Feed message;
  message.mutable_hello()->set_protocol_version(version);
  message.mutable_hello()->set_client_name("test");
  message.mutable_hello()->set_listens_only(listens_only);
  return framed(message);
}
inline v1::Feed::Sensors sensors(const FeedSensors& of) {
  v1::Feed::Sensors out;
  out.set_scans(of.scans);
  for (const Camera& camera : of.cameras) {
    auto& to = *out.add_camera();
    to.set_kind(static_cast<v1::Feed::Camera::Kind>(camera.model.kind));
    to.set_width_px(static_cast<std::uint32_t>(camera.model.width_px));
    to.set_height_px(static_cast<std::uint32_t>(camera.model.height_px));
    to.set_fx(camera.model.fx);
    to.set_fy(camera.model.fy);
    to.set_cx(camera.model.cx);
    to.set_cy(camera.model.cy);
    for (const double x : camera.model.distortion) to.add_distortion(x);
    write(camera.T_body_camera, *to.mutable_t_body_camera());
  }
  if (of.depth) {
    out.mutable_depth()->set_unit_m(of.depth->unit_m);
    out.mutable_depth()->set_sigma_m(of.depth->sigma_m);
    out.mutable_depth()->set_sigma_per_m2(of.depth->sigma_per_m2);
    out.mutable_depth()->set_least_m(of.depth->least_m);
    out.mutable_depth()->set_most_m(of.depth->most_m);
  }
  if (of.imu) {
    out.mutable_imu()->set_gyro_noise_density(of.imu->gyro_noise_density);
    out.mutable_imu()->set_gyro_random_walk(of.imu->gyro_random_walk);
    out.mutable_imu()->set_accelerometer_noise_density(of.imu->accelerometer_noise_density);
    out.mutable_imu()->set_accelerometer_random_walk(of.imu->accelerometer_random_walk);
  }
  return out;
}
inline std::string hello(const v1::Feed::Sensors& sensors) {
  v1::Feed message;
  message.mutable_hello()->set_protocol_version(kFeedVersion);
  *message.mutable_hello()->mutable_sensors() = sensors;
  return framed(message);
}
inline void write(const EncodedImage& image, v1::Feed::Image& out) {
  out.set_camera(image.camera);
  out.set_encoding(image.is_raw ? v1::Feed::Image::RAW : v1::Feed::Image::FILE);
  out.set_data(image.bytes);
}
inline std::string images(const FedImages& of) {
  v1::Feed message;
  message.mutable_images()->set_stamp_ns(of.stamp.ns);
  for (const EncodedImage& image : of.images) write(image, *message.mutable_images()->add_image());
  if (of.depth) write(*of.depth, *message.mutable_images()->mutable_depth());
  return framed(message);
}
inline std::string imu(const std::vector<ImuSample>& samples) {
  v1::Feed message;
  for (const ImuSample& sample : samples) {
    message.mutable_imu()->add_stamp_ns(sample.stamp.ns);
    for (int i = 0; i < 3; ++i) {
      message.mutable_imu()->add_gyro(sample.gyro[i]);
      message.mutable_imu()->add_accelerometer(sample.accelerometer[i]);
    }
  }
  return framed(message);
}

inline std::string odometry(const StampedPose& at, const Matrix6d& covariance) {
  v1::Feed message;
  auto& out = *message.mutable_odometry();
  out.set_stamp_ns(at.stamp.ns);
  write(at.pose, *out.mutable_t_odom_body());
  for (const double x : covariance.reshaped()) out.add_increment_covariance(x);
  return framed(message);
}
inline std::string scan(Timestamp stamp, int points) {
  v1::Feed message;
  message.mutable_scan()->set_stamp_ns(stamp.ns);
  for (int i = 0; i < 3 * points; ++i) message.mutable_scan()->add_xyz(static_cast<float>(1 + i % 7));
  return framed(message);
}
inline std::string scan(const Scan& of) {
  v1::Feed message;
  message.mutable_scan()->set_stamp_ns(of.stamp.ns);
  for (const Eigen::Vector3f& point : of.cloud->points)
    for (const float x : point) message.mutable_scan()->add_xyz(x);
  if (of.age_s) message.mutable_scan()->mutable_age_s()->Add(of.age_s->begin(), of.age_s->end());
  return framed(message);
}
inline std::string end_of_recording() {
  v1::Feed message;
  message.mutable_end_of_recording();
  return framed(message);
}

/// The messages in these bytes, which are whole frames.
inline std::vector<v1::Feed> messages(std::string_view bytes) {
  std::vector<v1::Feed> out;
  FrameReader reader;
  while (!bytes.empty()) {
    const auto payload = reader.take(bytes);
    if (!payload || !*payload) break;
    out.emplace_back().ParseFromString(**payload);
  }
  return out;
}

}  // namespace tutti::program::test
