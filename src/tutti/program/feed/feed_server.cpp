// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_server.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

namespace tutti::program {
namespace {

constexpr std::size_t kReadBytes = 256U << 10U;  // at most, of one client, before the others have their turn

Timestamp wall_clock() {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(since_epoch).count()};
}

double steady_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

bool would_wait() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

/// A file left there by a program that was killed goes; an error when it is in use or no socket.
Status free_path(const std::string& path, const sockaddr_un& address) {
  struct stat found {};
  if (lstat(path.c_str(), &found) != 0) return {};
  if (!S_ISSOCK(found.st_mode)) return fail(ErrorCode::io, "{}: exists and is no socket", path);
  const int probe = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const bool in_use = connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(probe);
  if (in_use) return fail(ErrorCode::io, "{}: another program listens there", path);
  unlink(path.c_str());
  return {};
}

std::optional<gid_t> group_of(const std::string& name) {
  group found{};
  group* is_there = nullptr;
  std::vector<char> buffer(64U << 10U);
  if (getgrnam_r(name.c_str(), &found, buffer.data(), buffer.size(), &is_there) != 0 || is_there == nullptr)
    return std::nullopt;
  return found.gr_gid;
}

}  // namespace

Result<std::unique_ptr<FeedServer>> FeedServer::listen(const std::string& path, FeedTarget& target,
                                                       const FeedSettings& settings, const FeedAccess& access,
                                                       intake::SensorConfig sensors) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    return fail(ErrorCode::io, "'{}': a socket's path has 1 to {} bytes, this one {}", path,
                sizeof address.sun_path - 1, path.size());
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  if (auto ok = free_path(path, address); !ok) return tl::unexpected(ok.error());
  const int listener = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const auto failed = [&](const char* what) {
    const int why = errno;
    if (listener >= 0) close(listener);
    return fail(ErrorCode::io, "{}: cannot {}: {}", path, what, std::strerror(why));
  };
  if (listener < 0) return failed("make a socket");
  // Before anybody can connect: nobody can until listen().
  if (bind(listener, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return failed("bind a socket");
  if (!access.group.empty()) {
    const auto group = group_of(access.group);
    if (!group) errno = ENOENT;
    if (!group || chown(path.c_str(), static_cast<uid_t>(-1), *group) != 0)
      return failed(fmt::format("give the socket to the group '{}'", access.group).c_str());
  }
  if (chmod(path.c_str(), access.mode) != 0) return failed("set the mode of the socket");
  if (::listen(listener, settings.max_clients) != 0) return failed("listen");
  return std::unique_ptr<FeedServer>(new FeedServer(path, listener, target, settings, std::move(sensors)));
}

FeedServer::FeedServer(std::string path, int listener, FeedTarget& target, const FeedSettings& settings,
                       intake::SensorConfig sensors)
    : path_(std::move(path)),
      listener_(listener),
      settings_(settings),
      session_(target, settings, wall_clock, std::move(sensors)) {}

FeedServer::~FeedServer() {
  for (const auto& [client, file] : files_) close(file);
  close(listener_);
  unlink(path_.c_str());
}

void FeedServer::serve(int timeout_ms) {
  Waiting waiting = begin();
  if (wait(waiting, timeout_ms)) finish(waiting);
}

FeedServer::Waiting FeedServer::begin() {
  session_.refresh();
  Waiting out{.files = {{.fd = listener_, .events = POLLIN, .revents = 0}}, .clients = {}};
  for (const auto& [client, file] : files_) {
    const bool listens = !session_.is_over(client) && !silent_.contains(client);
    const auto events = (listens ? POLLIN : 0) | (session_.output(client).empty() ? 0 : POLLOUT);
    out.files.push_back({.fd = file, .events = static_cast<short>(events), .revents = 0});
    out.clients.push_back(client);
  }
  return out;
}

bool FeedServer::wait(Waiting& waiting, int timeout_ms) {
  return poll(waiting.files.data(), waiting.files.size(), timeout_ms) >= 0;
}

void FeedServer::finish(const Waiting& waiting) {
  const auto& [files, clients] = waiting;
  for (std::size_t i = 0; i < clients.size(); ++i) {
    const short ready = files[i + 1].revents;
    const int file = files[i + 1].fd;
    const bool is_gone = (ready & (POLLERR | POLLHUP | POLLNVAL)) != 0;
    if ((ready & POLLIN) != 0 ? read_from(clients[i], file) : !is_gone) continue;
    // One that has sent all it has to send may still read.
    silent_.insert(clients[i]);
    if (!is_gone && session_.waits_for_end(clients[i])) continue;
    static_cast<void>(write_to(clients[i], file));
    drop(clients[i]);
  }
  if ((files[0].revents & POLLIN) != 0) accept_one();
  session_.close_stalled(steady_s());
  for (const auto& [client, file] : std::map(files_))
    if (!write_to(client, file) || (silent_.contains(client) && !session_.waits_for_end(client))) drop(client);
}

void FeedServer::accept_one() {
  const int file = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (file < 0) return;
  if (files_.size() >= static_cast<std::size_t>(settings_.max_clients) && !drop_silent()) {
    close(file);
    return;
  }
  files_[next_] = file;
  session_.connect(next_++);
}

bool FeedServer::drop_silent() {
  for (const auto& [client, of_client] : files_)
    if (!session_.is_greeted(client)) {
      drop(client);
      return true;
    }
  return false;
}

bool FeedServer::read_from(FeedSession::Client client, int file) {
  std::array<char, 64U << 10U> bytes;  // NOLINT: filled by recv
  for (std::size_t all = 0; all < kReadBytes && !session_.is_over(client);) {
    const ssize_t count = recv(file, bytes.data(), bytes.size(), 0);
    if (count < 0) return would_wait();
    if (count == 0) return false;
    session_.receive(client, {bytes.data(), static_cast<std::size_t>(count)});
    all += static_cast<std::size_t>(count);
  }
  return true;
}

bool FeedServer::write_to(FeedSession::Client client, int file) {
  for (std::string_view bytes = session_.output(client); !bytes.empty(); bytes = session_.output(client)) {
    const ssize_t count = send(file, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count < 0) return would_wait();
    session_.sent(client, static_cast<std::size_t>(count));
  }
  return !session_.is_over(client);
}

void FeedServer::drop(FeedSession::Client client) {
  session_.disconnect(client);
  close(files_.at(client));
  files_.erase(client);
  silent_.erase(client);
}

}  // namespace tutti::program
