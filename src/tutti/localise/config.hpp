// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/config.hpp"

namespace tutti::localise {

/// Settings of a robot that finds its place in a map that does not move.
struct LocaliserConfig {
  int candidates = 12;
  double track_every_s = 0.2;
  double lost_after_s = 1.0;
  double off_map_after_s = 2.0;
  double scan_silence_s = 2.0;
  template <class V>
  void describe(V& v) {
    v.field("candidates", candidates, between(1, 1000),
            "So many submaps of the map, those that look most alike from above, are compared with what the robot saw, "
            "while it does not know where it is.");
    v.field("track_every_s", track_every_s, at_least(0.0),
            "Once it knows, a scan is registered on the map this often.");
    v.field("lost_after_s", lost_after_s, greater_than(0.0),
            "It is lost when scans have contradicted the map for so long; then it searches again.");
    v.field("off_map_after_s", off_map_after_s, greater_than(0.0),
            "It is off the map when scans have shown nothing of it for so long, without contradicting it.");
    v.field("scan_silence_s", scan_silence_s, greater_than(0.0),
            "Its pose is stale when nothing was registered for so long.");
  }
};

}  // namespace tutti::localise
