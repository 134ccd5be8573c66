// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"

namespace tutti::simulation {

/// A grid of junctions, each moved at random, with some corridors left out: it has loops and no dead ends.
struct CorridorWorldConfig {
  int rows = 4;
  int columns = 5;
  double block_m = 25.0;
  double jitter_m = 5.0;
  double missing_share = 0.2;
  double max_slope = 0.06;  ///< Steepest corridor, rise over run.
  template <class V>
  void describe(V& v) {
    v.field("rows", rows, between(2, 100), "Rows of junctions.");
    v.field("columns", columns, between(2, 100), "Columns of junctions.");
    v.field("block_m", block_m, between(1.0, 500.0), "Distance between neighbouring junctions before they are moved.");
    v.field("jitter_m", jitter_m, between(0.0, 500.0),
            "Each junction moves by up to this along x and y; at most block_m / 4.");
    v.field("missing_share", missing_share, between(0.0, 1.0),
            "Share of corridors left out, as far as the network stays connected and without dead ends.");
  }
};

/// The appearance of a corridor. rough: there is something to see everywhere; featureless: straight, smooth and empty,
/// so a sensor cannot determine the position along it; office: flat walls, doors and corners; open: under the sky, with
/// almost nothing to see.
enum class CorridorKind { rough, featureless, office, open };

/// A straight corridor between two junctions.
struct Corridor {
  std::size_t a = 0;  ///< Junctions at its ends, as indices, a < b.
  std::size_t b = 0;
  double length_m = 0.0;
  CorridorKind kind = CorridorKind::rough;
};

/// Straight corridors between junctions, in the frame `reference`, z up.
struct CorridorWorld {
  std::vector<Eigen::Vector3d> junctions;
  std::vector<Corridor> corridors;
  std::vector<std::vector<std::size_t>> corridors_at;  ///< Indices of the corridors at each junction.

  [[nodiscard]] std::size_t other_end(std::size_t corridor, std::size_t junction) const {
    return corridors[corridor].a == junction ? corridors[corridor].b : corridors[corridor].a;
  }
};

/// Makes a connected world in which every junction is on at least two corridors.
CorridorWorld make_corridor_world(const CorridorWorldConfig& config, Rng rng);

/// Per junction the number of the network that it is in, where corridors do not join all of them.
std::vector<std::size_t> networks_of(const CorridorWorld& world);

/// `count` junctions far from each other (greedy farthest points from a random first one); they repeat when `count`
/// exceeds the junctions. Where there are several networks each has as many, but for one.
std::vector<std::size_t> spread_starts(const CorridorWorld& world, std::size_t count, Rng rng);

}  // namespace tutti::simulation
