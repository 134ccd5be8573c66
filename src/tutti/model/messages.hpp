// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tutti/base/ids.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/model/submap.hpp"

namespace tutti {

/// In front of every message; (robot, session, sequence) identifies it. Duplicates are recognised by what is inside:
/// a submap's id, a proxy graph's epoch and revision.
struct MessageHeader {
  RobotId robot;              ///< Sender; of a server's message: unused, 0.
  std::uint64_t session = 0;  ///< Of a robot: of its chain of odometry. Of the server: its epoch.
  std::uint64_t sequence = 0;
  friend bool operator==(const MessageHeader&, const MessageHeader&) = default;
};

struct SubmapMessage {  ///< robot -> server
  MessageHeader header;
  Submap submap;
};

struct ProxyGraphMessage {  ///< server -> every robot
  MessageHeader header;
  ProxyGraph graph;
};

}  // namespace tutti
