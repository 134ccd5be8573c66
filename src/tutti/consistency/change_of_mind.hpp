// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/timestamp.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::consistency {

/// How one chain's trajectory in a newer map differs from that in an older one, by how sure the older map was of it.
struct MapChange {
  /// The largest difference over what three standard deviations of the older map allow for: above 1 the map has changed
  /// its mind, and has not merely learned more. 0 where the older map does not say how sure it is, or where the two
  /// have fewer than two nodes in common.
  double significance = 0.0;
  /// What the node that moves most moves by, the two trajectories laid rigidly on each other.
  double translation_m = 0.0;
  double rotation_rad = 0.0;
  /// The nodes that move by at least half as much lie between these moments.
  Timestamp from, until;
  [[nodiscard]] bool is_change_of_mind() const { return significance > 1.0; }
  friend bool operator==(const MapChange&, const MapChange&) = default;
};

/// The older map's own test (DisagreementTest) of the newer map's poses. Two estimates of which the newer knows all
/// that the older knew differ by less than the older's own errors, so a calibrated map that only learns changes its
/// mind once in 370 updates. What the newer map has beside the older one's nodes does not count.
MapChange map_change(const ProxyGraph& older, const ProxyGraph& newer, const ChainId& chain);

}  // namespace tutti::consistency
