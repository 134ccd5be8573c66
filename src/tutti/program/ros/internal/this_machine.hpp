// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"

/// Keeps CycloneDDS on this machine, while programs that name another interface than loopback are heard: a ROS 2 that
/// is not told otherwise names the network's, also with ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST.
namespace tutti::ros::internal {

/// The IPv4 addresses of the interfaces that are up, but loopback; those on which a ROS 2 would choose to be first.
std::vector<std::string> network_addresses(std::size_t most);

/// The configuration of a participant that is at 127.0.0.1 and at these addresses, and sends no multicast to networks.
std::string this_machine_configuration(const std::vector<std::string>& addresses);

/// The sockets of a domain in this process that this_machine_configuration() configured.
struct DomainSockets {
  std::vector<int> receiving, sending;
};
DomainSockets sockets_of(std::uint32_t domain);

/// Lets the receiving ones take only what this machine sent, and the sending ones reach nothing but this machine.
Status hold_to_this_machine(const DomainSockets& sockets);

}  // namespace tutti::ros::internal
