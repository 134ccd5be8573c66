// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tutti/base/timestamp.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::mapfile {

/// A server's results on its map, for programs that read the map's file meanwhile (docs/storage.md): they would
/// otherwise have to compute it again.
struct ComputedMap {
  std::uint64_t epoch = 0;
  std::uint64_t revision = 0;
  Timestamp time;  ///< When it was begun, mission time.
  server::MapEstimate
      map;               ///< In a decoded one of the nodes only ids, poses and components, closures, failed odometry.
  ProxyGraph broadcast;  ///< As robots decode it.
};

/// A frame `estimate`. Exact, but for the proxy graph, which has the errors that robots see.
std::string encode_estimate(const ComputedMap& computed);
/// Accepts any bytes.
Result<ComputedMap> decode_estimate(std::string_view bytes);

}  // namespace tutti::mapfile
