// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_client.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "tutti/v1/feed.pb.h"

namespace tutti::program {
namespace {

void put_in(const Pose3& T, v1::Feed::Pose& out) {
  out.set_x(T.translation.x());
  out.set_y(T.translation.y());
  out.set_z(T.translation.z());
  out.set_qx(T.rotation.x());
  out.set_qy(T.rotation.y());
  out.set_qz(T.rotation.z());
  out.set_qw(T.rotation.w());
}

void put_in(const FeedSensors& sensors, v1::Feed::Sensors& out) {
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
    put_in(camera.T_body_camera, *to.mutable_t_body_camera());
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

void put_in(const EncodedImage& image, v1::Feed::Image& out) {
  out.set_camera(image.camera);
  out.set_encoding(image.is_raw ? v1::Feed::Image::RAW : v1::Feed::Image::FILE);
  out.set_data(image.bytes);
}

template <class Stamps, class Numbers>
Trajectory trajectory(const Stamps& stamps, const Numbers& numbers) {
  Trajectory out;
  for (int i = 0; i < stamps.size() && 7 * i + 6 < numbers.size(); ++i) {
    const auto at = [&](int k) { return numbers.Get(7 * i + k); };
    out.push_back({{stamps.Get(i)}, {Eigen::Quaterniond(at(6), at(3), at(4), at(5)), {at(0), at(1), at(2)}}});
  }
  return out;
}

FromRobot read(const v1::Feed& message) {
  switch (message.what_case()) {
    case v1::Feed::kWelcome: {
      const auto& welcome = message.welcome();
      return FeedWelcome{welcome.robot_name(),
                         welcome.has_odometry() ? std::optional(Timestamp{welcome.last_stamp_ns()}) : std::nullopt};
    }
    case v1::Feed::kCorrection: {
      const auto& said = message.correction();
      return FeedAnswer{{said.stamp_ns()},
                        said.wants_scan(),
                        said.has_stored() ? std::optional(Timestamp{said.stored_stamp_ns()}) : std::nullopt};
    }
    case v1::Feed::kTimeAnswer: {
      const auto& said = message.time_answer();
      return FeedProgress{said.has_stored() ? std::optional(Timestamp{said.stored_stamp_ns()}) : std::nullopt};
    }
    case v1::Feed::kRefused:
      return FeedRefusal{{message.refused().stamp_ns()}, message.refused().why()};
    case v1::Feed::kWay: {
      const auto& way = message.way();
      return FeedWay{{way.map_epoch(), way.map_revision()},
                     way.constraints(),
                     trajectory(way.stamp_ns(), way.t_map_body()),
                     trajectory(way.map_stamp_ns(), way.t_world_body())};
    }
    case v1::Feed::kEnded:
      return FeedEnd{};
    case v1::Feed::kClosed:
      return FeedOver{message.closed().why()};
    default:
      return FeedOther{};
  }
}

}  // namespace

Result<std::unique_ptr<FeedClient>> FeedClient::connect(const std::string& socket, const std::string& name,
                                                        const FeedSensors& sensors, bool wants_way) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (socket.empty() || socket.size() >= sizeof address.sun_path)
    return fail(ErrorCode::io, "'{}': a socket's path has 1 to {} bytes", socket, sizeof address.sun_path - 1);
  std::memcpy(address.sun_path, socket.c_str(), socket.size() + 1);
  std::unique_ptr<FeedClient> out(new FeedClient(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)));
  if (out->file_ < 0 || ::connect(out->file_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return fail(ErrorCode::io, "{}: cannot connect: {}", socket, std::strerror(errno));
  v1::Feed hello;
  hello.mutable_hello()->set_protocol_version(kFeedVersion);
  hello.mutable_hello()->set_client_name(name);
  hello.mutable_hello()->set_wants_way(wants_way);
  put_in(sensors, *hello.mutable_hello()->mutable_sensors());
  if (auto ok = out->send(hello.SerializeAsString()); !ok) return tl::unexpected(ok.error());
  return out;
}

FeedClient::~FeedClient() {
  if (file_ >= 0) close(file_);
}

Status FeedClient::send(const std::string& payload) {
  if (payload.size() > kMaxFeedBytes)
    return fail(ErrorCode::invalid, "a message of {} bytes, expected at most {}", payload.size(), kMaxFeedBytes);
  std::string bytes;
  for (std::size_t i = 0; i < 4; ++i) bytes += static_cast<char>(payload.size() >> (8 * i) & 0xffU);
  bytes += payload;
  for (std::string_view left = bytes; !left.empty();) {
    const ssize_t count = ::send(file_, left.data(), left.size(), MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return fail(ErrorCode::io, "the robot does not take what it is fed: {}", std::strerror(errno));
    left.remove_prefix(static_cast<std::size_t>(count));
  }
  return {};
}

Status FeedClient::say(const node::OdometrySample& sample) {
  v1::Feed message;
  message.mutable_odometry()->set_stamp_ns(sample.stamp.ns);
  put_in(sample.T_odom_body, *message.mutable_odometry()->mutable_t_odom_body());
  for (int i = 0; i < 36; ++i)
    message.mutable_odometry()->add_increment_covariance(sample.increment_covariance(i / 6, i % 6));
  return send(message.SerializeAsString());
}

Status FeedClient::say(const Scan& scan) {
  v1::Feed message;
  message.mutable_scan()->set_stamp_ns(scan.stamp.ns);
  for (const Eigen::Vector3f& point : scan.cloud->points)
    for (const float x : point) message.mutable_scan()->add_xyz(x);
  if (scan.age_s) message.mutable_scan()->mutable_age_s()->Add(scan.age_s->begin(), scan.age_s->end());
  return send(message.SerializeAsString());
}

Status FeedClient::say(const FedImages& images) {
  v1::Feed message;
  message.mutable_images()->set_stamp_ns(images.stamp.ns);
  for (const EncodedImage& image : images.images) put_in(image, *message.mutable_images()->add_image());
  if (images.depth) put_in(*images.depth, *message.mutable_images()->mutable_depth());
  return send(message.SerializeAsString());
}

Status FeedClient::say(const std::vector<ImuSample>& samples) {
  v1::Feed message;
  for (const ImuSample& sample : samples) {
    message.mutable_imu()->add_stamp_ns(sample.stamp.ns);
    for (int i = 0; i < 3; ++i) {
      message.mutable_imu()->add_gyro(sample.gyro[i]);
      message.mutable_imu()->add_accelerometer(sample.accelerometer[i]);
    }
  }
  return send(message.SerializeAsString());
}

Status FeedClient::say_time() {
  v1::Feed message;
  message.mutable_time();
  return send(message.SerializeAsString());
}

Status FeedClient::say_end() {
  v1::Feed message;
  message.mutable_end_of_recording();
  return send(message.SerializeAsString());
}

Result<std::optional<FromRobot>> FeedClient::hear(int timeout_ms) {
  while (true) {
    std::string_view left = unread_;
    auto payload = reader_.take(left);
    if (!payload) return tl::unexpected(payload.error());
    unread_.erase(0, unread_.size() - left.size());
    if (*payload) {
      v1::Feed message;
      if (!message.ParseFromString(**payload)) return fail(ErrorCode::parse, "the robot says what is no message");
      return read(message);
    }
    pollfd ready{.fd = file_, .events = POLLIN, .revents = 0};
    if (poll(&ready, 1, timeout_ms) <= 0) return std::nullopt;
    std::array<char, 64U << 10U> bytes;  // NOLINT: filled by recv
    const ssize_t count = recv(file_, bytes.data(), bytes.size(), 0);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return fail(ErrorCode::io, "the robot has ended the connection");
    unread_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace tutti::program
