// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_client.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "tutti/program/feed/internal/feed_messages.hpp"

namespace tutti::program {
namespace {

template <class Stamps, class Numbers>
Trajectory trajectory(const Stamps& stamps, const Numbers& numbers) {
  Trajectory out;
  for (int i = 0; i < stamps.size() && 7 * i + 6 < numbers.size(); ++i) {
    const auto at = [&](int k) { return numbers.Get(7 * i + k); };
    out.push_back({{stamps.Get(i)}, {Eigen::Quaterniond(at(6), at(3), at(4), at(5)), {at(0), at(1), at(2)}}});
  }
  return out;
}

Pose3 pose(const v1::Feed::Pose& said) {
  return {Eigen::Quaterniond(said.qw(), said.qx(), said.qy(), said.qz()), {said.x(), said.y(), said.z()}};
}

FeedAnswer answer(const v1::Feed::Correction& said) {
  FeedAnswer out{.stamp = {said.stamp_ns()},
                 .wants_scan = said.wants_scan(),
                 .stored = said.has_stored() ? std::optional(Timestamp{said.stored_stamp_ns()}) : std::nullopt,
                 .T_map_body = pose(said.t_map_body()),
                 .T_map_odom = pose(said.t_map_odom()),
                 .map_age = {said.map_epoch(), said.map_revision()},
                 .in_map = said.in_map()};
  for (int i = 0; i < std::min(36, said.t_map_odom_covariance_size()); ++i)
    out.covariance(i / 6, i % 6) = said.t_map_odom_covariance(i);
  return out;
}

FeedSituation situation(const v1::Feed::Situation& said) {
  FeedSituation out{.in_map = said.in_map(), .team_mates = {}, .alerts = {}, .status = {}};
  for (const auto& mate : said.team_mate())
    out.team_mates.push_back({RobotId{mate.robot()},
                              mate.name(),
                              {mate.stamp_ns()},
                              mate.same_component() ? std::optional(pose(mate.t_map_body())) : std::nullopt});
  for (const auto& alert : said.alert()) out.alerts.push_back(alert.text());
  for (const auto& value : said.status()) out.status.emplace_back(value.name(), value.text());
  return out;
}

FromRobot read(const v1::Feed& message) {
  switch (message.what_case()) {
    case v1::Feed::kWelcome: {
      const auto& welcome = message.welcome();
      return FeedWelcome{welcome.robot_name(),
                         welcome.has_odometry() ? std::optional(Timestamp{welcome.last_stamp_ns()}) : std::nullopt,
                         pose(welcome.t_map_odom())};
    }
    case v1::Feed::kCorrection:
      return answer(message.correction());
    case v1::Feed::kJump:
      return FeedJump{message.jump().translation_m(), message.jump().why()};
    case v1::Feed::kSituation:
      return situation(message.situation());
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
                                                        const intake::FeedSensors& sensors, bool wants_way) {
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
  internal::write(sensors, *hello.mutable_hello()->mutable_sensors());
  if (auto ok = out->send(hello); !ok) return tl::unexpected(ok.error());
  return out;
}

FeedClient::~FeedClient() {
  if (file_ >= 0) close(file_);
}

Status FeedClient::send(const v1::Feed& message) {
  const std::size_t size = message.ByteSizeLong();
  if (size > kMaxFeedBytes)
    return fail(ErrorCode::invalid, "a message of {} bytes, expected at most {}", size, kMaxFeedBytes);
  const std::string bytes = internal::framed(message);
  for (std::string_view left = bytes; !left.empty();) {
    const ssize_t count = ::send(file_, left.data(), left.size(), MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return fail(ErrorCode::io, "the robot does not take what it is fed: {}", std::strerror(errno));
    left.remove_prefix(static_cast<std::size_t>(count));
  }
  return {};
}

Status FeedClient::say(const node::OdometrySample& sample) { return send(internal::message_of(sample)); }

Status FeedClient::say(const Scan& scan) { return send(internal::message_of(scan)); }

Status FeedClient::say(const intake::FedImages& images) { return send(internal::message_of(images)); }

Status FeedClient::say(const std::vector<ImuSample>& samples) { return send(internal::message_of(samples)); }

Status FeedClient::say(const PositionFix& fix) { return send(internal::message_of(fix)); }

Status FeedClient::say(const Health& health) { return send(internal::message_of(health)); }

Status FeedClient::say_time() {
  v1::Feed message;
  message.mutable_time();
  return send(message);
}

Status FeedClient::say_end() {
  v1::Feed message;
  message.mutable_end_of_recording();
  return send(message);
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
