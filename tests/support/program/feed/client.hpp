// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "support/program/feed/client_messages.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/program/feed/feed_frames.hpp"

/// The client's end of a live feed.
namespace tutti::program::test {

using internal::framed;

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
inline v1::Feed::Sensors sensors(const Sensors& of) {
  v1::Feed::Sensors out;
  write(of, out);
  return out;
}
inline std::string hello(const v1::Feed::Sensors& sensors) {
  v1::Feed message;
  message.mutable_hello()->set_protocol_version(kFeedVersion);
  *message.mutable_hello()->mutable_sensors() = sensors;
  return framed(message);
}
inline std::string images(const EncodedImages& of) { return framed(message_of(of)); }
inline std::string imu(const std::vector<ImuSample>& samples) { return framed(message_of(samples)); }
inline std::string fix(const PositionFix& of) { return framed(message_of(of)); }

inline std::string odometry(const StampedPose& at, const Matrix6d& covariance) {
  return framed(message_of(OdometrySample{at.stamp, at.pose, covariance}));
}
inline std::string scan(Timestamp stamp, int points) {
  v1::Feed message;
  message.mutable_scan()->set_stamp_ns(stamp.ns);
  for (int i = 0; i < 3 * points; ++i) message.mutable_scan()->add_xyz(static_cast<float>(1 + i % 7));
  return framed(message);
}
inline std::string scan(const Scan& of) { return framed(message_of(of)); }
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
