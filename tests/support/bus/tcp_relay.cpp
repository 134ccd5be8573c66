// SPDX-License-Identifier: BSD-3-Clause
#include "support/bus/tcp_relay.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <deque>
#include <list>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace tutti::test {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr int kPoll_ms = 2;
constexpr std::size_t kPacketBytes = 4096;
constexpr std::size_t kUnderWay = 64;  ///< Packets per connection and direction; a socket's buffer is beside it.

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

/// A socket that ends with a reset: what was under way is lost.
class Socket {
 public:
  explicit Socket(int file) : file_(file) {
    const int on = 1;
    const linger reset{.l_onoff = 1, .l_linger = 0};
    setsockopt(file_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    setsockopt(file_, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
    fcntl(file_, F_SETFL, O_NONBLOCK);
    fcntl(file_, F_SETFD, FD_CLOEXEC);
  }
  ~Socket() { close(file_); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  [[nodiscard]] int file() const { return file_; }

 private:
  int file_;
};

struct Packet {
  Clock::time_point due;
  std::string bytes;
};

struct Connection {
  Connection(int client, int server) : ends{Socket(client), Socket(server)} {}
  std::array<Socket, 2> ends;
  std::array<std::deque<Packet>, 2> under_way;  ///< From that end to the other.
  bool broken = false;
};

}  // namespace

class TcpRelay::Loop {
 public:
  Loop(TcpRelay& relay, int listener, int target_port, const Link& link)
      : relay_(relay), listener_(listener), target_(loopback(target_port)), link_(link), rng_(link.seed) {
    draw_cut();
  }

  void run() {
    while (!relay_.stopping_) {
      wait();
      accept_all();
      if (relay_.refused_) connections_.clear();
      if (!relay_.held_)
        for (Connection& connection : connections_)
          for (std::size_t from = 0; from < 2; ++from) take(connection, from), give(connection, from);
      if (cut_) {
        ++relay_.cuts_;
        connections_.clear();
        draw_cut();
      }
      connections_.remove_if([](const Connection& connection) { return connection.broken; });
    }
  }

 private:
  void draw_cut() {
    cut_ = false;
    if (link_.bytes_between_cuts > 0)
      until_cut_ = std::uniform_int_distribution<std::uint64_t>(1, 2 * link_.bytes_between_cuts)(rng_);
  }

  void wait() {
    std::vector<pollfd> files{{listener_.file(), POLLIN, 0}};
    if (!relay_.held_)
      for (const Connection& connection : connections_)
        for (std::size_t from = 0; from < 2; ++from)
          if (connection.under_way[from].size() < kUnderWay) files.push_back({connection.ends[from].file(), POLLIN, 0});
    poll(files.data(), files.size(), kPoll_ms);
  }

  void accept_all() {
    for (int client = accept(listener_.file(), nullptr, nullptr); client >= 0;
         client = accept(listener_.file(), nullptr, nullptr)) {
      const int server = socket(AF_INET, SOCK_STREAM, 0);
      const bool through = connect(server, reinterpret_cast<const sockaddr*>(&target_), sizeof target_) == 0;
      Connection& made = connections_.emplace_back(client, server);
      made.broken = !through || relay_.refused_;
    }
  }

  void take(Connection& connection, std::size_t from) {
    while (connection.under_way[from].size() < kUnderWay && !connection.broken) {
      std::string bytes(kPacketBytes, '\0');
      const ssize_t size = recv(connection.ends[from].file(), bytes.data(), bytes.size(), 0);
      if (size < 0 && (errno == EAGAIN || errno == EINTR)) return;
      if (size <= 0) {
        connection.broken = true;
        return;
      }
      bytes.resize(static_cast<std::size_t>(size));
      const auto now = Clock::now();
      Clock::time_point& free_at = free_at_[from];
      free_at = std::max(free_at, now);
      if (link_.bytes_per_s > 0.0)
        free_at += std::chrono::duration_cast<Clock::duration>(Seconds(static_cast<double>(size) / link_.bytes_per_s));
      const auto due = free_at + std::chrono::duration_cast<Clock::duration>(Seconds(link_.delay_s));
      connection.under_way[from].push_back({due, std::move(bytes)});
    }
  }

  void give(Connection& connection, std::size_t from) {
    auto& packets = connection.under_way[from];
    while (!packets.empty() && packets.front().due <= Clock::now() && !connection.broken && !cut_) {
      std::string& bytes = packets.front().bytes;
      std::size_t size = bytes.size();
      if (link_.bytes_between_cuts > 0 && size >= until_cut_) {
        size = until_cut_;
        cut_ = true;
      }
      const ssize_t sent = send(connection.ends[1 - from].file(), bytes.data(), size, MSG_NOSIGNAL);
      if (sent < 0 && errno != EAGAIN) connection.broken = true;
      if (sent < 0) return;
      relay_.bytes_ += static_cast<std::uint64_t>(sent);
      until_cut_ -= std::min(until_cut_, static_cast<std::uint64_t>(sent));
      bytes.erase(0, static_cast<std::size_t>(sent));
      if (bytes.empty()) packets.pop_front();
    }
  }

  TcpRelay& relay_;
  Socket listener_;
  sockaddr_in target_;
  Link link_;
  std::mt19937_64 rng_;
  std::uint64_t until_cut_ = 0;
  bool cut_ = false;
  std::array<Clock::time_point, 2> free_at_{};
  std::list<Connection> connections_;
};

TcpRelay::TcpRelay(int target_port, const Link& link) {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  if (bind(listener, reinterpret_cast<sockaddr*>(&address), size) != 0 || listen(listener, 16) != 0 ||
      getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    throw std::runtime_error("no port for a relay");
  port_ = ntohs(address.sin_port);
  thread_ = std::thread([this, listener, target_port, link] { Loop(*this, listener, target_port, link).run(); });
}

TcpRelay::~TcpRelay() {
  stopping_ = true;
  thread_.join();
}

}  // namespace tutti::test
