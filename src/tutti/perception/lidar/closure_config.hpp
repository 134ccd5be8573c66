// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/config.hpp"

namespace tutti::lidar {

struct NormalConfig {
  int neighbours = 12;             ///< Points of the plane fit, the point itself included.
  double max_radius_m = 1.0;       ///< Neighbours farther than this are not used.
  double max_surface_ratio = 0.2;  ///< Smallest over middle eigenvalue of the scatter; above it: no normal.
  template <class V>
  void describe(V& v) {
    v.field("neighbours", neighbours, between(4, 64), "Points of the plane fit.");
  }
};

/// One stage of the registration.
struct RegistrationLevel {
  double max_distance_m = 0.3;  ///< Correspondences farther apart are not used.
  int max_points = 4000;        ///< Source points used, evenly spread.
  int max_iterations = 15;      ///< Gauss-Newton steps at most.
};

struct RegistrationConfig {
  std::vector<RegistrationLevel> levels{{1.5, 500, 8}, {0.6, 1000, 8}, {0.3, 4000, 12}};  ///< Coarse to fine.
  double overlap_distance_m = 0.3;  ///< A point overlaps when a target point with a like normal is this close.
};

inline constexpr double kDistinct_deg = 12.0;  ///< Two alignments differ by this yaw,
inline constexpr double kDistinct_m = 2.0;     ///< or this far: beyond what the registration would bridge.

/// Search for the rough relative pose by correlating views from above.
struct CandidateConfig {
  double cell_m = 0.8;      ///< Cell of the 64 x 64 view from above.
  int wall_directions = 2;  ///< Of each submap; any of one is laid on any of the other, either way round.
  int max_guesses = 3;      ///< Best alignments handed to the registration.
  template <class V>
  void describe(V& v) {
    v.field("cell_m", cell_m, greater_than(0.0), "Cell of the 64 x 64 view from above.");
  }
};

/// From two submap clouds to a loop closure or a refusal. Every gate is a physical quantity.
struct LidarClosureConfig {
  double min_duration_s = 5.0;  ///< Shorter submaps saw too little, on foot: they gave wrong closures.
  double min_way_m = 10.0;      ///< But they are used when they come as far as this: by car that is 1.4 s.
  int min_keyframes = 6;        ///< Submaps with fewer keyframes are not used.
  int min_points = 500;
  double voxel_m = 0.3;  ///< Clouds are thinned to this; denser ones cost time and gain nothing.
  NormalConfig normals;
  CandidateConfig candidates;
  RegistrationConfig registration;
  double min_overlap = 0.3;                ///< Mean of both directions.
  double max_viewpoint_distance_m = 25.0;  ///< Between the middles of the two ways; farther apart says little.
  double max_misfit = 1.4;                 ///< Residuals over what noise, roughness and odometry explain.
  double max_plane_rmse_m = 0.085;         ///< Point to plane, over the overlap.
  double min_eigenvalue = 0.03;            ///< Of the normalised translation Hessian (trace 1): below it, clouds slide.
  double sure_eigenvalue = 0.1;  ///< With less, max_misfit shrinks towards 1: little evidence must fit all the better.
  double max_contradiction = 0.15;  ///< Share of the points in view that stand where the other looked through.
  double max_rival_ratio = 0.75;    ///< A second, different alignment nearly as good: the place is ambiguous.
  template <class V>
  void describe(V& v) {
    v.field("min_duration_s", min_duration_s, at_least(0.0),
            "Submaps shorter than this and than min_way_m are not used.");
    v.field("min_way_m", min_way_m, at_least(0.0), "Travel from which a submap may take less than min_duration_s.");
    v.field("min_points", min_points, at_least(10), "Submaps with fewer points are not used.");
    v.field("voxel_m", voxel_m, greater_than(0.0), "Clouds are thinned to voxels of this edge.");
    v.field("normals", normals, any(), "Surface normals.");
    v.field("candidates", candidates, any(), "Rough alignment.");
    v.field("min_overlap", min_overlap, between(0.0, 1.0), "Mean overlap of both directions.");
    v.field("max_viewpoint_distance_m", max_viewpoint_distance_m, greater_than(0.0),
            "Between the middles of the two ways; closures from farther apart are not looked for. In a network that is "
            "walked for an hour a few metres leave more than enough closures.");
    v.field(
        "sure_eigenvalue", sure_eigenvalue, between(0.0, 0.34),
        "Below this eigenvalue max_misfit shrinks in proportion towards 1: little evidence must fit all the better.");
  }
};

}  // namespace tutti::lidar
