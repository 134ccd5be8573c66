// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"

namespace tutti::ros::internal {

/// The UDP sockets of this process that are bound to a port of the domain.
std::vector<int> sockets_of(std::uint32_t domain);

/// The network interface that a socket receives from; empty: from all.
std::string interface_of(int socket);

/// Lets these sockets receive from loopback only.
Status hold_to_loopback(const std::vector<int>& sockets);

}  // namespace tutti::ros::internal
