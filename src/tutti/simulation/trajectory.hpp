// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/rows.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/simulation/bounds.hpp"
#include "tutti/simulation/corridor_world.hpp"

namespace tutti::simulation {

/// A gait that can be chosen.
struct Gait {
  std::string_view name, help;
  double sway_deg = 0.0;  ///< Roll and pitch.
  double bob_m = 0.0;     ///< Up and down.
  double step_hz = 1.0;
};
const std::vector<Gait>& gaits();

/// How a robot walks; `describe` explains the fields.
struct WalkConfig {
  double duration_s = 1200.0;
  double length_m = 0.0;
  double rate_hz = 8.0;
  double min_speed_mps = 0.6;
  double max_speed_mps = 1.0;
  double pauses_per_min = 0.0;
  double pause_s = 8.0;
  std::vector<int> route;
  double lookahead_m = 2.0;
  std::string gait = "walking";
  template <class V>
  void describe(V& v) {
    v.field("duration_s", duration_s, above_zero_to(kLongest_s), "Length of the walk.");
    v.field("length_m", length_m, between(0.0, kFarthest_m),
            "Way to travel: all speeds are scaled so that the walk has this length; 0 = as far as the speeds lead.");
    v.field("rate_hz", rate_hz, between(0.1, 1000.0), "Poses per second.");
    v.field("min_speed_mps", min_speed_mps, above_zero_to(100.0), "Slowest speed along the path.");
    v.field("max_speed_mps", max_speed_mps, above_zero_to(100.0), "Fastest speed along the path.");
    v.field("pauses_per_min", pauses_per_min, between(0.0, 60.0), "How often the robot stops to look around.");
    v.field("pause_s", pause_s, above_zero_to(kLongest_s), "Mean length of such a stop.");
    v.field("route", route, at_least(0.0),
            "Junctions to walk to, in order and then again from the first; neighbours in the list, and last and first, "
            "must be joined by a corridor, without turning back. Empty: the corridors seen least.");
    v.field("lookahead_m", lookahead_m, between(0.1, kFarthest_m),
            "How far ahead the robot steers; wider turns with more.");
    v.field("gait", gait, one_of(names_of(gaits())), help_of(gaits()) + ".");
  }
};

/// Fails unless `config.route` is a closed walk along corridors of this world without U-turns, `start_junction` is a
/// junction, there is room for `lookahead_m`, and the walk is short enough to be computed.
Status check_walk(const CorridorWorld& world, const WalkConfig& config, std::optional<std::size_t> start_junction);

/// Simulates a walk from junction to junction. Without a route the robot makes no U-turns and prefers the corridors it
/// has seen least: it covers the network, then revisits it, sometimes in the other direction. The first junction is
/// drawn when none is given. With a route the robot repeats it, starting at its first junction.
///
/// The result is T_reference_body, body x ahead, z up, with `start` as its first stamp. Position, heading and attitude
/// are continuous, because the robot steers towards a point ahead on the path (Coulter 1992, "Implementation of the
/// Pure Pursuit Path Tracking Algorithm"). The gait fades out when the robot stands. Throws on what check_walk()
/// refuses.
Trajectory simulate_walk(const CorridorWorld& world, const WalkConfig& config, Timestamp start,
                         std::optional<std::size_t> start_junction, Rng rng);

}  // namespace tutti::simulation
