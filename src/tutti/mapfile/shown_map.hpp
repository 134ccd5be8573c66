// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tutti/base/timestamp.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/node/server_node.hpp"

namespace tutti::mapfile {

/// A map as a server has it at one moment; its clouds are in the server's store.
struct ShownMap {
  std::uint64_t revision = 0;
  Timestamp time;   ///< Mission time.
  Content content;  ///< Submaps with the sizes of their payloads only, names, verdicts with closures, words.
  server::MapEstimate map;
  ProxyGraph broadcast;  ///< The last proxy graph; empty: there was none yet.
};

/// A copy of the server's map: none of its parts is the server's any more, but for the submaps, which never change.
ShownMap shown_map(const node::ServerNode& server, Timestamp now);

}  // namespace tutti::mapfile
