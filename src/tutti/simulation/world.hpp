// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/rows.hpp"
#include "tutti/simulation/bounds.hpp"
#include "tutti/simulation/corridor_world.hpp"

namespace tutti::simulation {

inline constexpr double kLongestLoop_m = 1000.0;

struct WorldConfig;
/// A kind of world that can be chosen.
struct WorldKind {
  std::string_view name;
  std::string_view help;
  CorridorWorld (*make)(const WorldConfig& config, Rng rng);
};
const std::vector<WorldKind>& world_kinds();

/// Which world robots walk in; each field's text names the `kind` that it is for.
struct WorldConfig {
  std::string kind = "tunnel";
  CorridorWorldConfig network;      ///< tunnel, storeys
  double featureless_share = 0.15;  ///< tunnel: share of the corridors
  std::vector<int> featureless;     ///< tunnel: further corridors, as pairs of junctions
  double office_length_m = 30.0;    ///< terrace, like all that follow
  double office_width_m = 18.0;
  double roof_length_m = 45.0;
  double roof_width_m = 30.0;
  double ramp_length_m = 14.0;
  double ramp_rise_m = 0.6;
  template <class V>
  void describe(V& v) {
    v.field("kind", kind, one_of(names_of(world_kinds())), help_of(world_kinds()) + ".");
    v.field("network", network, any(), "tunnel, storeys: the corridors.");
    v.field("featureless_share", featureless_share, between(0.0, 1.0),
            "tunnel: share of the corridors that are straight, smooth and empty: the longest.");
    v.field("featureless", featureless, at_least(0.0),
            "tunnel: also the corridors between these junctions, two by two.");
    v.field("roof_length_m", roof_length_m, above_zero_to(kLongestLoop_m), "terrace: the loop on the roof, x.");
    v.field("roof_width_m", roof_width_m, above_zero_to(kLongestLoop_m), "terrace: the loop on the roof, y.");
    v.field("ramp_length_m", ramp_length_m, above_zero_to(kLongestLoop_m),
            "terrace: from the office to the loop on the roof.");
    v.field("ramp_rise_m", ramp_rise_m, between(-kLongestLoop_m, kLongestLoop_m),
            "terrace: the roof above the office.");
  }
};

/// Makes the network that robots walk on, in which every corridor has its kind (Corridor::kind) and nothing is a dead
/// end.
///   tunnel: make_corridor_world(); the longest corridors and the named ones are featureless, the others
///   rough.
///   storeys: two tunnels, each with corridors of its own, one kStorey_m above the other. Nothing joins them.
///   terrace: junctions about every 10 m, counter-clockwise on both loops. The office comes first, from the corner at
///   the origin (with the default size 0 to 9, corners 0, 3, 5, 8), with a cross-corridor (1 to 7); then the roof,
///   level, from the end of the ramp on (10 to 24; the ramp is 4 to 10). Corridors of the roof are open, all others are
///   office.
CorridorWorld make_world(const WorldConfig& config, Rng rng);
inline constexpr double kStorey_m = 15.0;  ///< More than a tunnel's height and all that its corridors rise.
/// Fails when the configuration names a corridor that the world of make_world() does not have.
Status check_world(const CorridorWorld& world, const WorldConfig& config);

/// The corridor nearest to a position, if the position is within `max_distance_m` of its centre line; else nothing.
std::optional<std::size_t> corridor_at(const CorridorWorld& world, const Eigen::Vector3d& position,
                                       double max_distance_m);

}  // namespace tutti::simulation
