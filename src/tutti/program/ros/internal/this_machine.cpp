// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/internal/this_machine.hpp"

#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <string_view>

namespace tutti::ros::internal {
namespace {

constexpr std::string_view kInterface = "lo";

/// The port of an IPv4 socket for datagrams; 0 for everything else.
std::uint32_t udp_port_of(int file) {
  int type = 0;
  socklen_t size = sizeof type;
  if (getsockopt(file, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return 0;
  sockaddr_in address{};
  size = sizeof address;
  if (getsockname(file, reinterpret_cast<sockaddr*>(&address), &size) != 0 || address.sin_family != AF_INET) return 0;
  return ntohs(address.sin_port);
}

}  // namespace

std::vector<int> sockets_of(std::uint32_t domain) {
  constexpr std::uint32_t kFirst = 7400, kPerDomain = 250;  // DDSI-RTPS 2.5, 9.6.2.4: "PB" and "DG"
  std::vector<int> out;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", none)) {
    const std::string name = entry.path().filename();
    int file = -1;
    if (std::from_chars(name.data(), name.data() + name.size(), file).ec != std::errc()) continue;
    const std::uint32_t port = udp_port_of(file), first = kFirst + kPerDomain * domain;
    if (port >= first && port < first + kPerDomain) out.push_back(file);
  }
  return out;
}

std::string interface_of(int socket) {
  std::array<char, IFNAMSIZ> name{};
  socklen_t size = name.size();
  if (getsockopt(socket, SOL_SOCKET, SO_BINDTODEVICE, name.data(), &size) != 0) return {};
  return name.data();
}

Status hold_to_loopback(const std::vector<int>& sockets) {
  for (const int socket : sockets)
    if (setsockopt(socket, SOL_SOCKET, SO_BINDTODEVICE, kInterface.data(), kInterface.size()) != 0)
      return fail(ErrorCode::io, "a socket cannot be held to interface '{}': {}", kInterface, std::strerror(errno));
  return {};
}

}  // namespace tutti::ros::internal
