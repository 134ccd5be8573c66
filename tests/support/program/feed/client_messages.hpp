// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/check.hpp"
#include "tutti/model/input.hpp"
#include "tutti/program/feed/internal/feed_messages.hpp"
#include "tutti/wire/field_bytes.hpp"

/// Writes the messages (feed.proto) of a client of the live feed. Clients are other programs.
namespace tutti::program::test {

using internal::write;

inline void write(const EncodedImage& image, v1::Feed::Image& out) {
  out.set_camera(image.camera);
  out.set_encoding(image.is_raw ? v1::Feed::Image::RAW : v1::Feed::Image::FILE);
  out.set_data(image.bytes);
}

inline void write(const OdometrySample& sample, v1::Feed& message) {
  auto& out = *message.mutable_odometry();
  out.set_stamp_ns(sample.stamp.ns);
  write(sample.T_odom_body, *out.mutable_t_odom_body());
  for (int i = 0; i < 36; ++i) out.add_increment_covariance(sample.increment_covariance(i / 6, i % 6));
}

inline void write(const Scan& scan, v1::Feed& message) {
  auto& out = *message.mutable_scan();
  out.set_stamp_ns(scan.stamp.ns);
  for (const Eigen::Vector3f& point : scan.cloud->points)
    for (const float x : point) out.add_xyz(x);
  if (scan.age_s) out.mutable_age_s()->Add(scan.age_s->begin(), scan.age_s->end());
}

inline void write(const EncodedImages& images, v1::Feed& message) {
  auto& out = *message.mutable_images();
  out.set_stamp_ns(images.stamp.ns);
  for (const EncodedImage& image : images.images) write(image, *out.add_image());
  if (images.depth) write(*images.depth, *out.mutable_depth());
}

inline void write(const ImuSamples& samples, v1::Feed& message) {
  auto& out = *message.mutable_imu();
  for (const ImuSample& sample : samples) {
    out.add_stamp_ns(sample.stamp.ns);
    for (int i = 0; i < 3; ++i) {
      out.add_gyro(sample.gyro[i]);
      out.add_accelerometer(sample.accelerometer[i]);
    }
  }
}

inline void write(const PositionFix& fix, v1::Feed& message) {
  auto& out = *message.mutable_fix();
  out.set_stamp_ns(fix.stamp.ns);
  out.set_latitude_deg(fix.antenna.latitude_deg);
  out.set_longitude_deg(fix.antenna.longitude_deg);
  out.set_height_m(fix.antenna.height_m);
  for (int i = 0; i < 9; ++i) out.add_covariance_m2(fix.covariance(i / 3, i % 3));
  for (const double x : fix.p_body_antenna) out.add_p_body_antenna(x);
}

inline void write(const RobotRange& range, v1::Feed& message) {
  TUTTI_CHECK(message.mutable_range()->ParseFromString(wire::field_bytes(range)), "range");
  message.mutable_range()->set_name(range.name);
}

inline void write(const Health& health, v1::Feed& message) {
  TUTTI_CHECK(message.mutable_health()->ParseFromString(wire::field_bytes(health)), "health");
}

inline void write(const StartPose& start, v1::Feed& message) {
  auto& out = *message.mutable_start_pose();
  out.set_is_planar(start.is_planar);
  out.set_floor(start.floor.value_or(0));
  if (!start.T_world_body) return;
  write(start.T_world_body->T_a_b, *out.mutable_t_world_body());
  for (int i = 0; i < 36; ++i) out.add_covariance(start.T_world_body->covariance(i / 6, i % 6));
}

/// They are made on board.
inline void write(const TrackedImages& images, v1::Feed& /*message*/) {
  TUTTI_CHECK(false, "tracked images at {} ns are not fed", images.stamp.ns);
}

inline void write(const Sensors& sensors, v1::Feed::Sensors& out) {
  out.set_scans(sensors.scans);
  for (const Camera& camera : sensors.cameras) {
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
  if (sensors.depth) {
    out.mutable_depth()->set_unit_m(sensors.depth->unit_m);
    out.mutable_depth()->set_sigma_m(sensors.depth->sigma_m);
    out.mutable_depth()->set_sigma_per_m2(sensors.depth->sigma_per_m2);
    out.mutable_depth()->set_least_m(sensors.depth->least_m);
    out.mutable_depth()->set_most_m(sensors.depth->most_m);
  }
  if (!sensors.imu) return;
  out.mutable_imu()->set_gyro_noise_density(sensors.imu->gyro_noise_density);
  out.mutable_imu()->set_gyro_random_walk(sensors.imu->gyro_random_walk);
  out.mutable_imu()->set_accelerometer_noise_density(sensors.imu->accelerometer_noise_density);
  out.mutable_imu()->set_accelerometer_random_walk(sensors.imu->accelerometer_random_walk);
}

inline v1::Feed message_of(const Input& input) {
  v1::Feed message;
  std::visit([&](const auto& sample) { write(sample, message); }, input);
  return message;
}

}  // namespace tutti::program::test
