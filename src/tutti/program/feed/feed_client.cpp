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

#include "tutti/program/feed/internal/feed_messages.hpp"

namespace tutti::program {

Result<std::unique_ptr<FeedClient>> FeedClient::connect(const std::string& socket, const std::string& name,
                                                        const Sensors& sensors, bool wants_trajectory) {
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
  hello.mutable_hello()->set_wants_trajectory(wants_trajectory);
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

Status FeedClient::say(const Input& input) { return send(internal::message_of(input)); }

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
      auto message = decode_from_robot(**payload);
      if (!message) return tl::unexpected(message.error());
      return std::move(*message);
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
