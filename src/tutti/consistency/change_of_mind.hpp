// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/timestamp.hpp"
#include "tutti/model/proxy_graph.hpp"

namespace tutti::consistency {

/// How one chain's trajectory in a newer map differs from that in an older map, in units of the older map's
/// uncertainty.
struct MapChange {
  /// The largest difference divided by three of the older map's standard deviations. Above 1 the map has changed its
  /// mind, and not merely learned more. 0 where the older map has no uncertainty, or where the two maps have
  /// fewer than two nodes in common.
  double significance = 0.0;
  /// The largest movement of any node, after one rigid alignment of the two trajectories.
  double translation_m = 0.0;
  double rotation_rad = 0.0;
  /// The first and last keyframe time of the nodes that move in position by at least half of `translation_m`.
  Timestamp from, until;
  template <class V>
  void describe(V& v) {
    v.field(1, "significance", significance);
    v.field(2, "translation_m", translation_m);
    v.field(3, "rotation_rad", rotation_rad);
    v.field(4, "from", from);
    v.field(5, "until", until);
  }
  [[nodiscard]] bool is_change_of_mind() const { return significance > 1.0; }
  friend bool operator==(const MapChange&, const MapChange&) = default;
};

/// Applies the older map's own test (DisagreementTest) to the newer map's poses. When the newer map knows all that the
/// older one knew, the two differ by less than the older one's errors; a calibrated map that only learns therefore
/// exceeds a significance of 1 in one update of 370. Nodes that only one of the maps has do not count.
MapChange map_change(const ProxyGraph& older, const ProxyGraph& newer, const ChainId& chain);

}  // namespace tutti::consistency
