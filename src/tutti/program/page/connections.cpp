// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/internal/connections.hpp"

#include <sys/socket.h>

#include <tuple>
#include <utility>

namespace tutti::page {

bool Connections::enter(int socket, std::string address, double now_s) {
  const std::scoped_lock lock(mutex_);
  if (is_closed_ || open_.size() >= kThreads) return false;
  std::size_t all = 0, of_address = 0;
  for (const auto& [other, one] : open_) {
    if (one.is_ended) continue;
    ++all;
    if (one.address == address) ++of_address;
  }
  if (of_address >= kMostOfAddress) {
    if (!make_room(now_s, address)) return false;
  } else if (all >= kMost && !make_room(now_s, std::nullopt)) {
    return false;
  }
  open_[socket] = {.address = std::move(address), .waits_since_s = now_s};
  return true;
}

void Connections::leave(int socket) {
  const std::scoped_lock lock(mutex_);
  open_.erase(socket);
}

void Connections::waits(int socket, std::optional<double> since_s) {
  const std::scoped_lock lock(mutex_);
  if (const auto found = open_.find(socket); found != open_.end()) found->second.waits_since_s = since_s;
}

bool Connections::make_room(double now_s, const std::optional<std::string>& of) {
  std::map<std::string, int> by_address;
  for (const auto& [socket, one] : open_)
    if (!one.is_ended) ++by_address[one.address];
  std::optional<std::tuple<int, double, int>> worst;  // how many its address has, how long it waits, which
  for (const auto& [socket, one] : open_) {
    if (one.is_ended || !one.waits_since_s || (of && one.address != *of)) continue;
    const std::tuple candidate(by_address[one.address], now_s - *one.waits_since_s, socket);
    if (!worst || candidate > *worst) worst = candidate;
  }
  if (!worst) return false;
  const int socket = std::get<2>(*worst);
  end(socket, open_.at(socket));
  return true;
}

void Connections::close() {
  const std::scoped_lock lock(mutex_);
  is_closed_ = true;
  for (auto& [socket, one] : open_) end(socket, one);
}

void Connections::end(int socket, Connection& connection) {
  connection.is_ended = true;
  static_cast<void>(shutdown(socket, SHUT_RDWR));  // whoever waits for it returns; its own thread closes it
}

}  // namespace tutti::page
