// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/ros/internal/this_machine.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <linux/filter.h>
#include <linux/if_packet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>

namespace tutti::ros::internal {
namespace {

constexpr std::string_view kLoopback = "lo";

/// The port of an IPv4 socket for datagrams.
std::optional<std::uint32_t> udp_port_of(int file) {
  int type = 0;
  socklen_t size = sizeof type;
  if (getsockopt(file, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_DGRAM) return {};
  sockaddr_in address{};
  size = sizeof address;
  if (getsockname(file, reinterpret_cast<sockaddr*>(&address), &size) != 0 || address.sin_family != AF_INET) return {};
  return ntohs(address.sin_port);
}

/// As the configuration has it for those that send; others have the kernel's 1.
bool keeps_multicast_here(int socket) {
  int hops = 1;
  socklen_t size = sizeof hops;
  return getsockopt(socket, IPPROTO_IP, IP_MULTICAST_TTL, &hops, &size) == 0 && hops == 0;
}

bool is_held(int socket) {
  std::array<char, IFNAMSIZ> name{};
  socklen_t size = name.size();
  return getsockopt(socket, SOL_SOCKET, SO_BINDTODEVICE, name.data(), &size) == 0 && name.data() == kLoopback;
}

/// Takes packets of the loopback interface, which are all that this machine sends to an address of its own, and its own
/// multicast to a network, which the kernel marks. Whatever else a network brings is dropped within the kernel. A
/// socket that is bound to the interface "lo" would not hear what was sent to the machine's address on a network.
Status take_only_own(int socket) {
  constexpr auto kAncillary = static_cast<std::uint32_t>(SKF_AD_OFF);
  constexpr std::uint32_t kWhole = 0xffff'ffff, kNothing = 0;
  std::array<sock_filter, 6> code{{
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kAncillary + SKF_AD_IFINDEX),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, if_nametoindex(kLoopback.data()), 2, 0),
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kAncillary + SKF_AD_PKTTYPE),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_LOOPBACK, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, kWhole),
      BPF_STMT(BPF_RET | BPF_K, kNothing),
  }};
  const sock_fprog program{code.size(), code.data()};
  if (setsockopt(socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) == 0) return {};
  return fail(ErrorCode::io, "a socket cannot be made to take only what this machine sends: {}", std::strerror(errno));
}

}  // namespace

std::vector<std::string> network_addresses(std::size_t most) {
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) return {};
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> all(first, &freeifaddrs);
  std::vector<std::pair<bool, std::string>> found;  // whether it is one that discovery is rarely on
  for (const ifaddrs* each = first; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET) continue;
    if ((each->ifa_flags & IFF_UP) == 0 || (each->ifa_flags & IFF_LOOPBACK) != 0) continue;
    sockaddr_in address{};
    std::memcpy(&address, each->ifa_addr, sizeof address);
    constexpr std::uint32_t kLinkLocal = 0xa9fe;  // 169.254: CycloneDDS takes none beside others
    if (ntohl(address.sin_addr.s_addr) >> 16U == kLinkLocal) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    inet_ntop(AF_INET, &address.sin_addr, text.data(), text.size());
    const bool is_rare = (each->ifa_flags & IFF_MULTICAST) == 0 || (each->ifa_flags & IFF_POINTOPOINT) != 0;
    found.emplace_back(is_rare, text.data());
  }
  std::ranges::stable_sort(found, {}, &std::pair<bool, std::string>::first);
  std::vector<std::string> out;
  for (const auto& [is_rare, address] : found)
    if (out.size() < most) out.push_back(address);
  return out;
}

/// Loopback may have no multicast, and programs that have it switched off are found at the ports of the first hundred.
std::string this_machine_configuration(const std::vector<std::string>& addresses) {
  std::string interfaces = "<NetworkInterface address='127.0.0.1' multicast='true'/>";
  for (const std::string& address : addresses)
    interfaces += fmt::format("<NetworkInterface address='{}' multicast='true' presence_required='false'/>", address);
  return fmt::format(
      "<General><Interfaces>{}</Interfaces><AllowMulticast>spdp</AllowMulticast>"
      "<MulticastTimeToLive>0</MulticastTimeToLive></General>"
      "<Discovery><ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>99</MaxAutoParticipantIndex>"
      "<Peers><Peer address='127.0.0.1'/></Peers></Discovery>",
      interfaces);
}

DomainSockets sockets_of(std::uint32_t domain) {
  constexpr std::uint32_t kFirst = 7400, kPerDomain = 250;  // DDSI-RTPS 2.5, 9.6.2.4: "PB" and "DG"
  DomainSockets out;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", none)) {
    const std::string name = entry.path().filename();
    int file = -1;
    if (std::from_chars(name.data(), name.data() + name.size(), file).ec != std::errc()) continue;
    const std::optional<std::uint32_t> port = udp_port_of(file);
    if (!port) continue;
    const std::uint32_t first = kFirst + kPerDomain * domain;
    if (keeps_multicast_here(file))
      out.sending.push_back(file);
    else if (*port >= first && *port < first + kPerDomain)
      out.receiving.push_back(file);
  }
  return out;
}

Status hold_to_this_machine(const DomainSockets& sockets) {
  for (const int socket : sockets.receiving)
    if (Status ok = take_only_own(socket); !ok) return ok;
  for (const int socket : sockets.sending)  // those of another domain are held already, and nobody may hold them twice
    if (!is_held(socket) && setsockopt(socket, SOL_SOCKET, SO_BINDTODEVICE, kLoopback.data(), kLoopback.size()) != 0)
      return fail(ErrorCode::io, "a socket cannot be held to interface '{}': {}", kLoopback, std::strerror(errno));
  return {};
}

}  // namespace tutti::ros::internal
