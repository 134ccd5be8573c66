// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace tutti::program {

/// How a live feed smooths corrections, and how much it does for slow or many clients.
struct FeedSettings {
  double blend_m_per_s = 0.2;    ///< A correction moves the robot on its map no faster, beside its own motion,
  double blend_deg_per_s = 2.0;  ///< and turns it no faster than this,
  double jump_m = 1.0;           ///< unless more is left to go than this: a jump, which is announced;
  double jump_deg = 10.0;        ///< or to turn.
  int max_queue_kb = 1024;       ///< Queue of a client that does not read; beyond it the oldest corrections go.
  int max_clients = 16;          ///< Connections at a time.
};

}  // namespace tutti::program
