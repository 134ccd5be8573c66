// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/guarded_stream.hpp"

#include <arpa/inet.h>
#include <fmt/core.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>

#include "tutti/program/clock.hpp"
#include "tutti/program/field_json.hpp"

namespace tutti::page {
namespace {

constexpr double kBodyRate = 16384.0, kWriteRate = 4096.0;  // bytes a second
constexpr double kLinger_s = 3.0;
constexpr std::size_t kMostLingered = 2 * kMostBody;  // of a body that is too long
constexpr std::string_view kEmptyLine = "\r\n\r\n";

double now_s() { return program::Clock::steady_s(); }

void name(const sockaddr_storage& address, std::string& ip, int& port) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (address.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(address);
    inet_ntop(AF_INET, &v4.sin_addr, text.data(), text.size());
    port = ntohs(v4.sin_port);
  } else if (address.ss_family == AF_INET6) {
    const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address);
    inet_ntop(AF_INET6, &v6.sin6_addr, text.data(), text.size());
    port = ntohs(v6.sin6_port);
  }
  ip = text.data();
}

}  // namespace

bool GuardedStream::accept_tls() {
  const double begin_s = now_s();
  connections_.waits(socket_, begin_s);
  for (;;) {
    ERR_clear_error();
    const int result = SSL_accept(tls_);
    if (result == 1) break;
    if (!waits(result, 0, begin_s + patience_.head_s)) return false;
  }
  connections_.waits(socket_, std::nullopt);
  return true;
}

bool GuardedStream::next_request(bool is_first) {
  connections_.waits(socket_, now_s());
  const auto end = read_head(is_first);
  connections_.waits(socket_, std::nullopt);
  if (!end) return false;
  auto head = checked_head(std::string_view(in_).substr(0, *end));
  in_.erase(0, *end);
  if (!head) {
    refuse(head.error());
    return false;
  }
  head_ = std::move(head->text);
  head_read_ = 0;
  body_left_ = head->body;
  body_since_s_ = now_s();
  const std::size_t photo = body_left_ - std::min(body_left_, kMostOrder);
  body_until_s_ = body_since_s_ + patience_.body_s + static_cast<double>(photo) / kBodyRate;
  return true;
}

/// Where the head ends in in_; nothing: there is none.
std::optional<std::size_t> GuardedStream::read_head(bool is_first) {
  double until_s = now_s() + (is_first ? patience_.head_s : patience_.keep_alive_s);
  if (!in_.empty()) until_s = now_s() + patience_.head_s;
  for (std::size_t looked = 0;;) {
    if (const std::size_t at = in_.find(kEmptyLine, looked); at != std::string::npos) return at + kEmptyLine.size();
    looked = in_.size() < kEmptyLine.size() ? 0 : in_.size() - kEmptyLine.size() + 1;
    if (in_.size() > kMostHead) {
      refuse({431, fmt::format("a request's head has at most {} bytes here", kMostHead)});
      return std::nullopt;
    }
    if (in_.find("\r\n") == std::string::npos && in_.size() > kMostLine) {
      refuse({414, fmt::format("a request's line has at most {} bytes here", kMostLine)});
      return std::nullopt;
    }
    std::array<char, 4096> some;
    const std::size_t count = receive(some.data(), some.size(), until_s);
    if (count == 0) return std::nullopt;
    if (in_.empty() && !is_first) until_s = now_s() + patience_.head_s;
    in_.append(some.data(), count);
  }
}

void GuardedStream::refuse(const HeadRefusal& refusal) {
  const std::string text = text_of(nlohmann::ordered_json{{"error", refusal.why}});
  const std::string answer = fmt::format(
      "HTTP/1.1 {} Refused\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}",
      refusal.status, text.size(), text);
  if (write(answer.data(), answer.size()) > 0) linger();
}

void GuardedStream::linger() {
  connections_.waits(socket_, now_s());
  if (tls_ != nullptr) SSL_shutdown(tls_);
  static_cast<void>(shutdown(socket_, SHUT_WR));
  tls_ = nullptr;  // what still comes is not looked at
  const double until_s = now_s() + kLinger_s;
  std::array<char, 16384> some;
  for (std::size_t passed = 0; passed < kMostLingered && now_s() < until_s;) {
    const std::size_t count = receive(some.data(), some.size(), until_s);
    if (count == 0) return;
    passed += count;
  }
}

ssize_t GuardedStream::read(char* to, std::size_t most) {
  std::size_t count = std::min(most, head_.size() - head_read_);
  if (count > 0) {
    head_.copy(to, count, head_read_);
    head_read_ += count;
    return static_cast<ssize_t>(count);
  }
  count = std::min(most, body_left_);
  if (count == 0) return 0;
  if (!in_.empty()) {
    count = std::min(count, in_.size());
    in_.copy(to, count);
    in_.erase(0, count);
  } else {
    connections_.waits(socket_, body_since_s_);  // of all its bytes, and not anew with each
    count = receive(to, count, body_until_s_);
    connections_.waits(socket_, std::nullopt);
  }
  body_left_ -= count;
  return count == 0 ? -1 : static_cast<ssize_t>(count);
}

std::size_t GuardedStream::receive(char* to, std::size_t most, double deadline_s) {
  for (;;) {
    ERR_clear_error();
    const auto count = tls_ != nullptr ? SSL_read(tls_, to, static_cast<int>(most)) : recv(socket_, to, most, 0);
    if (count > 0) return static_cast<std::size_t>(count);
    if (!waits(static_cast<int>(count), POLLIN, deadline_s)) return 0;
  }
}

ssize_t GuardedStream::write(const char* from, std::size_t count) {
  const double begin_s = now_s(), until_s = begin_s + patience_.write_s + static_cast<double>(count) / kWriteRate;
  std::size_t written = 0;
  while (written < count && !is_broken_) {
    ERR_clear_error();
    const std::size_t some = std::min<std::size_t>(count - written, 1U << 20U);
    const auto sent = tls_ != nullptr ? SSL_write(tls_, from + written, static_cast<int>(some))
                                      : send(socket_, from + written, some, MSG_NOSIGNAL);
    if (sent > 0) {
      written += static_cast<std::size_t>(sent);
      continue;
    }
    connections_.waits(socket_, begin_s);
    is_broken_ = !waits(static_cast<int>(sent), POLLOUT, until_s);
  }
  connections_.waits(socket_, std::nullopt);
  return is_broken_ ? -1 : static_cast<ssize_t>(count);
}

bool GuardedStream::waits(int result, short events, double deadline_s) const {
  if (tls_ != nullptr) {
    const int error = SSL_get_error(tls_, result);
    if (error != SSL_ERROR_WANT_READ && error != SSL_ERROR_WANT_WRITE) return false;
    events = error == SSL_ERROR_WANT_READ ? POLLIN : POLLOUT;
  } else if (result == 0 || (errno != EAGAIN && errno != EINTR)) {
    return false;
  }
  const double left_s = deadline_s - now_s();
  if (left_s <= 0.0) return false;
  pollfd waited{.fd = socket_, .events = events, .revents = 0};
  const int ready = poll(&waited, 1, static_cast<int>(std::ceil(1e3 * left_s)));
  return ready > 0 || (ready < 0 && errno == EINTR);
}

void GuardedStream::get_remote_ip_and_port(std::string& ip, int& port) const {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (getpeername(socket_, reinterpret_cast<sockaddr*>(&address), &size) == 0) name(address, ip, port);
}

void GuardedStream::get_local_ip_and_port(std::string& ip, int& port) const {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  if (getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size) == 0) name(address, ip, port);
}

}  // namespace tutti::page
