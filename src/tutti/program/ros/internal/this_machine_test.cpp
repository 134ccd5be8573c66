// SPDX-License-Identifier: BSD-3-Clause
// In a network of the test's own, of which it is the wire: what others send is put into it, what leaves is read off it.
#include "tutti/program/ros/internal/this_machine.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <netinet/in.h>
#include <netinet/ip.h>
#include <netinet/udp.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <string>
#include <thread>

#include "support/program/ros/loopback.hpp"
#include "tutti/bags/ros_encode.hpp"

namespace tutti::ros::internal {
namespace this_machine_test {

constexpr const char *kOwn = "10.9.8.1", *kOther = "10.9.8.2", *kGroup = "239.255.0.1";
constexpr int kNoNetwork = 77, kFine = 0;
constexpr std::uint16_t kPort = 47'011;

sockaddr_in address_of(const char* text, std::uint16_t port) {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  out.sin_port = htons(port);
  inet_pton(AF_INET, text, &out.sin_addr);
  return out;
}

void require(bool is_so, const char* what) {
  if (is_so) return;
  static_cast<void>(std::fprintf(stderr, "%s: %s\n", what, std::strerror(errno)));
  std::_Exit(1);
}

/// The wire of the network 10.9.8.0/24, on which this process is 10.9.8.1; ends the process where it may make none.
int wire() {
  if (const pid_t child = fork(); child != 0) {  // that has one thread, as a user without rights needs to have
    int status = 0;
    waitpid(child, &status, 0);
    std::_Exit(WIFEXITED(status) ? WEXITSTATUS(status) : 1);
  }
  if (unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) std::_Exit(kNoNetwork);
  const int out = open("/dev/net/tun", O_RDWR | O_NONBLOCK | O_CLOEXEC), control = socket(AF_INET, SOCK_DGRAM, 0);
  ifreq request{};
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  if (out < 0 || ioctl(out, TUNSETIFF, &request) != 0) std::_Exit(kNoNetwork);
  const auto set = [&](const char* address, unsigned long what) {
    const sockaddr_in in = address_of(address, 0);
    std::memcpy(&request.ifr_addr, &in, sizeof in);
    require(ioctl(control, what, &request) == 0, address);
  };
  set(kOwn, SIOCSIFADDR);
  set("255.255.255.0", SIOCSIFNETMASK);
  for (const bool is_loopback : {false, true}) {
    if (is_loopback) std::strcpy(request.ifr_name, "lo");
    request.ifr_flags = IFF_UP | IFF_MULTICAST;
    require(ioctl(control, SIOCSIFFLAGS, &request) == 0, "up");
  }
  close(control);
  return out;
}

/// A packet of UDP from the other machine.
void put_on(int wire, const char* to, std::uint16_t port) {
  std::array<char, sizeof(iphdr) + sizeof(udphdr) + 4> packet{};
  iphdr ip{};
  ip.version = 4;
  ip.ihl = 5;
  ip.tot_len = htons(packet.size());
  ip.ttl = 1;
  ip.protocol = IPPROTO_UDP;
  ip.saddr = address_of(kOther, 0).sin_addr.s_addr;
  ip.daddr = address_of(to, 0).sin_addr.s_addr;
  std::array<std::uint16_t, sizeof(iphdr) / 2> words{};
  std::memcpy(words.data(), &ip, sizeof ip);
  std::uint32_t sum = 0;
  for (const std::uint16_t word : words) sum += word;
  ip.check = static_cast<std::uint16_t>(~((sum & 0xffffU) + (sum >> 16U)));
  udphdr udp{};
  udp.source = udp.dest = htons(port);
  udp.len = htons(sizeof(udphdr) + 4);
  std::memcpy(packet.data(), &ip, sizeof ip);
  std::memcpy(packet.data() + sizeof ip, &udp, sizeof udp);
  require(write(wire, packet.data(), packet.size()) > 0, "a packet from the network");
}

int receiver(const char* group = nullptr) {
  const int out = socket(AF_INET, SOCK_DGRAM, 0), one = 1;
  setsockopt(out, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
  const sockaddr_in any = address_of("0.0.0.0", kPort);
  require(bind(out, reinterpret_cast<const sockaddr*>(&any), sizeof any) == 0, "bind");
  const ip_mreq member{address_of(group == nullptr ? kGroup : group, 0).sin_addr, address_of(kOwn, 0).sin_addr};
  if (group != nullptr)
    require(setsockopt(out, IPPROTO_IP, IP_ADD_MEMBERSHIP, &member, sizeof member) == 0, "membership");
  return out;
}

bool has_heard(int socket) {
  std::array<char, 10> some{};
  for (int i = 0; i < 20; ++i) {
    if (recv(socket, some.data(), some.size(), MSG_DONTWAIT) > 0) return true;
    usleep(10'000);
  }
  return false;
}

void send_from(int socket, const char* to) {
  const sockaddr_in there = address_of(to, kPort);
  sendto(socket, "tutti", 5, 0, reinterpret_cast<const sockaddr*>(&there), sizeof there);
}

/// The protocols of what has left for the network: IPPROTO_UDP, ..; of IPv4.
std::string left_by(int wire) {
  std::string out;
  std::array<char, 2048> packet{};
  usleep(100'000);
  while (read(wire, packet.data(), packet.size()) > 0)
    if ((packet[0] >> 4U) == 4) out += packet[offsetof(iphdr, protocol)];
  return out;
}

/// Statements of death tests are run in a new process.
void only_this_machine_is_heard_and_reached() {
  const int network = wire();
  require(network_addresses(3) == std::vector<std::string>{kOwn}, "addresses");
  const int heard = receiver(), group = receiver(kGroup), sender = socket(AF_INET, SOCK_DGRAM, 0);
  put_on(network, kOwn, kPort);
  require(has_heard(heard) || has_heard(group), "the network is not heard: this test is none");
  require(hold_to_this_machine({.receiving = {heard, group}, .sending = {}}).has_value(), "hold");
  close(heard);  // of two that share a port only one is given what is sent to an address
  put_on(network, kOwn, kPort);
  put_on(network, kGroup, kPort);
  require(!has_heard(group), "another machine was heard");
  const in_addr own = address_of(kOwn, 0).sin_addr;
  setsockopt(sender, IPPROTO_IP, IP_MULTICAST_IF, &own, sizeof own);
  for (const char* to : {"127.0.0.1", kOwn, kGroup}) {
    send_from(sender, to);
    require(has_heard(group), to);
  }
  send_from(sender, kOther);
  require(left_by(network).find(IPPROTO_UDP) != std::string::npos, "nothing leaves: this test is none");
  require(hold_to_this_machine({.receiving = {}, .sending = {sender}}).has_value(), "hold");
  require(hold_to_this_machine({.receiving = {}, .sending = {sender}}).has_value(), "hold again");
  for (const char* to : {kOther, kGroup}) send_from(sender, to);
  require(left_by(network).find(IPPROTO_UDP) == std::string::npos, "something left");
  for (const char* to : {"127.0.0.1", kOwn}) {
    send_from(sender, to);
    require(has_heard(group), to);
  }
  std::_Exit(kFine);
}

/// But for the kernel, which tells the network of memberships in groups.
void a_participant_sends_nothing_to_the_network() {
  const int network = wire();
  const auto me = Participant::open(7, Reach::this_machine).value();
  const auto odom = me->writer("/odom", "nav_msgs/msg/Odometry", {}, "").value();
  for (int i = 0; i < 20; ++i) {
    require(odom->write(bags::encode(bags::RosOdometry{})).has_value(), "write");
    usleep(50'000);
  }
  require(left_by(network).find(IPPROTO_UDP) == std::string::npos, "something left");
  const DomainSockets sockets = sockets_of(7);
  require(sockets.sending.size() == 2 && sockets.receiving.size() == 4, "sockets");
  std::_Exit(kFine);
}

bool is_fine_or_not_to_be_tried(int status) {
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNoNetwork) std::puts("not tried: this user may make no network");
  return WIFEXITED(status) && (WEXITSTATUS(status) == kFine || WEXITSTATUS(status) == kNoNetwork);
}

TEST(ThisMachineDeathTest, OnlyThisMachineIsHeardAndReached) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(only_this_machine_is_heard_and_reached(), is_fine_or_not_to_be_tried, "");
}

TEST(ThisMachineDeathTest, AParticipantSendsNothingToTheNetwork) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(a_participant_sends_nothing_to_the_network(), is_fine_or_not_to_be_tried, "");
}

TEST(ThisMachine, WithoutMoreBeingAskedForEverySocketIsHeld) {
  setenv("CYCLONEDDS_URI", "<General><Interfaces><NetworkInterface autodetermine='true'/></Interfaces></General>", 1);
  const auto here = test::join_loopback();
  unsetenv("CYCLONEDDS_URI");
  const auto filter_of = [](int socket) {
    socklen_t size = 0;
    return getsockopt(socket, SOL_SOCKET, SO_GET_FILTER, nullptr, &size) == 0 ? size : 0;
  };
  const auto device_of = [](int socket) {
    std::array<char, IFNAMSIZ> name{};
    socklen_t size = name.size();
    getsockopt(socket, SOL_SOCKET, SO_BINDTODEVICE, name.data(), &size);
    return std::string(name.data());
  };
  const DomainSockets held = sockets_of(test::loopback_domain());
  ASSERT_EQ(held.receiving.size(), 4U);
  ASSERT_FALSE(held.sending.empty());
  for (const int socket : held.receiving) EXPECT_GT(filter_of(socket), 0U);
  for (const int socket : held.sending) EXPECT_EQ(device_of(socket), "lo");

  const std::uint32_t other = test::free_domain();
  const auto everywhere = Participant::open(other, Reach::network);
  ASSERT_TRUE(everywhere) << everywhere.error().message;
  const DomainSockets open_sockets = sockets_of(other);
  ASSERT_FALSE(open_sockets.receiving.empty());
  for (const int socket : open_sockets.receiving) EXPECT_EQ(filter_of(socket), 0U);
}

}  // namespace this_machine_test
}  // namespace tutti::ros::internal
