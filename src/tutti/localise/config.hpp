// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/config.hpp"

namespace tutti::localise {

/// Settings of a robot that finds its place in a map that does not move.
struct LocaliserConfig {
  int candidates = 12;
  double track_every_s = 0.2;
  template <class V>
  void describe(V& v) {
    v.field("candidates", candidates, between(1, 1000),
            "So many submaps of the map, those that look most alike from above, are compared with what the robot saw, "
            "while it does not know where it is.");
    v.field("track_every_s", track_every_s, at_least(0.0),
            "Once it knows, a scan is registered on the map this often.");
  }
};

}  // namespace tutti::localise
