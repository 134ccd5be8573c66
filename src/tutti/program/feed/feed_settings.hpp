// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "tutti/base/config.hpp"

namespace tutti::program {

/// How a live feed smooths corrections, and how much it does for slow or many clients; `describe` explains each.
struct FeedSettings {
  double blend_m_per_s = 0.2;
  double blend_deg_per_s = 2.0;
  double jump_m = 1.0;
  double jump_deg = 10.0;
  int max_queue_kb = 1024;
  int max_clients = 16;
  template <class V>
  void describe(V& v) {
    v.field("blend_m_per_s", blend_m_per_s, greater_than(0.0),
            "A correction moves the robot on its map no faster than this, beside its own motion,");
    v.field("blend_deg_per_s", blend_deg_per_s, greater_than(0.0), "... and turns it no faster than this,");
    v.field("jump_m", jump_m, greater_than(0.0),
            "... unless more is left to go than this: a jump, which is announced;");
    v.field("jump_deg", jump_deg, greater_than(0.0), "... or to turn.");
    v.field("max_queue_kb", max_queue_kb, between(1, 1'000'000),
            "What waits for a client that does not read; beyond it loses the oldest corrections.");
    v.field("max_clients", max_clients, between(1, 1000), "Connections at a time.");
  }
};

}  // namespace tutti::program
