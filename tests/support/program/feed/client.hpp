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
