// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/simulation/bounds.hpp"
#include "tutti/simulation/corridor_world.hpp"
#include "tutti/simulation/triangle_mesh.hpp"

namespace tutti::simulation {

class FreeSpace;

inline constexpr double kHeight_m = 2.8;  ///< Rough and featureless corridors'.
inline constexpr double kOfficeHeight_m = 2.6;
inline constexpr double kRoofMargin_m = 4.0;  ///< Distance from the outermost open corridors to the roof's edge.

/// The appearance of a world's walls. Widths and heights are those of the smooth shape.
struct SurfaceConfig {
  double cell_m = 0.25;
  double body_height_m = 0.55;
  double width_m = 3.2;
  double office_width_m = 2.4;     ///< Office corridors'.
  double doors_per_100m = 20.0;    ///< Office: door niches; every third stands open to a room.
  double parapet_height_m = 0.35;  ///< Roof: wall around its edge.
  int chimneys = 2;                ///< Roof: the only things that stand on it, beside the house of the door.
  double changed_share = 0.0;      ///< Share of the walls that is gone.
  template <class V>
  void describe(V& v) {
    v.field("cell_m", cell_m, between(0.05, 1.0), "Grid the surface is built on: details below it are lost.");
    v.field("body_height_m", body_height_m, above_zero_to(kLargestRoom_m),
            "Height of the network's lines above the floor.");
    v.field("width_m", width_m, above_zero_to(kLargestRoom_m), "Width of rough and featureless corridors.");
    v.field(
        "changed_share", changed_share, between(0.0, 1.0),
        "Above 0 it is another day: this share of the walls of rough and featureless corridors is gone, in sections of "
        "2 m with 2 m of space behind them, and all that stands in rough ones stands elsewhere.");
  }
};

/// Fails when the grid of this world's surface is too large to be computed.
Status check_surface(const CorridorWorld& world, const SurfaceConfig& config);

/// The walls, floors and ceilings around a world's corridors: the zero set of FreeSpace, extracted by naive surface
/// nets (Gibson, "Constrained Elastic Surface Nets", MICCAI 1998; without elasticity, and with each vertex then moved
/// onto the zero set) on a grid that exists near corridors only. The surface is closed except above the roof of open
/// corridors, which ends at its parapet.
TriangleMesh world_surface(const CorridorWorld& world, const SurfaceConfig& config, Rng rng);
/// The zero set of any free space on a grid of `cell_m`, by the same method.
TriangleMesh extract_surface(const FreeSpace& space, double cell_m);

/// A survey: points spread evenly over the surface, on average one per spacing_m^2.
PointCloud sample_surface(const TriangleMesh& mesh, double spacing_m, Rng rng);

}  // namespace tutti::simulation
