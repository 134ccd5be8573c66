// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/config.hpp"

namespace tutti::lidar {

struct NormalConfig {
  int neighbours = 12;        ///< Points of a plane fit, the point itself included.
  double max_radius_m = 1.0;  ///< Neighbours farther than this are not used.
  /// Ratio of the smallest to the middle eigenvalue of their scatter above which a point gets no normal.
  double max_surface_ratio = 0.2;
};

/// One stage of the registration.
struct RegistrationLevel {
  double max_distance_m = 0.3;  ///< Points farther apart do not correspond.
  int max_points = 4000;        ///< Limit on the source points used, which are evenly spread.
  int max_iterations = 15;      ///< Limit on the Gauss-Newton steps.
};

struct RegistrationConfig {
  std::vector<RegistrationLevel> levels{{1.5, 500, 8}, {0.6, 1000, 8}, {0.3, 4000, 12}};  ///< Coarse to fine.
  /// A source point overlaps when a target point with a similar normal is this close.
  double overlap_distance_m = 0.3;
};

inline constexpr double kDistinct_deg = 12.0;  ///< Two alignments are distinct when they differ by this angle,
inline constexpr double kDistinct_m = 2.0;     ///< or by this distance: the registration would not bridge more.

/// Search for the rough relative pose by correlating views from above.
struct CandidateConfig {
  double cell_m = 0.8;  ///< Cell of the 64 x 64 view from above.
  /// Wall directions of each submap; each of one is laid on each of the other, in either direction.
  int wall_directions = 2;
  int max_guesses = 3;  ///< Limit on the rough alignments that are registered.
};

/// Settings of LiDAR closures, from two submap clouds to a loop closure or a refusal. Every gate is a physical
/// quantity.
struct LidarClosureConfig {
  /// Submaps shorter than this and than min_distance_m are not used: they saw too little and gave wrong closures.
  double min_duration_s = 5.0;
  double min_distance_m = 10.0;  ///< Travel from which a submap may be shorter than min_duration_s, as by car.
  int min_keyframes = 6;         ///< Submaps with fewer keyframes are not used.
  int min_points = 500;
  double voxel_m = 0.3;  ///< Voxels that clouds are thinned to; denser clouds cost time and gain nothing.
  NormalConfig normals;
  CandidateConfig candidates;
  RegistrationConfig registration;
  double min_overlap = 0.3;  ///< Least mean overlap of both directions.
  /// Between the middle keyframes of the two submaps; closures from farther apart add little.
  double max_viewpoint_distance_m = 25.0;
  double max_misfit = 1.4;          ///< Largest ratio of the residuals to what noise, roughness and odometry explain.
  double max_plane_rmse_m = 0.085;  ///< Point to plane, over the overlap.
  /// Least eigenvalue of the normalised translation Hessian (trace 1): below it the clouds slide.
  double min_eigenvalue = 0.03;
  /// Below this eigenvalue max_misfit shrinks towards 1: little evidence must fit all the better.
  double sure_eigenvalue = 0.1;
  /// Largest share of the points in view that lie where the other submap looked through.
  double max_contradiction = 0.15;
  double max_rival_ratio = 0.75;  ///< Largest quality of a second, distinct alignment over that of the best: above it
                                  ///< the place is ambiguous.
  template <class V>
  void describe(V& v) {
    v.field("min_duration_s", min_duration_s, at_least(0.0),
            "Submaps shorter than this and than min_distance_m are not used.");
    v.field("min_distance_m", min_distance_m, at_least(0.0), "Longer ones may take less than min_duration_s.");
    v.field("min_points", min_points, at_least(10), "Submaps with fewer points are not used.");
    v.field("min_overlap", min_overlap, between(0.0, 1.0), "Mean overlap of both directions.");
    v.field("max_viewpoint_distance_m", max_viewpoint_distance_m, greater_than(0.0),
            "Between the middles of the two trajectories; closures from farther apart are not looked for. In a network "
            "that is "
            "walked for an hour a few metres leave more than enough closures.");
  }
};

}  // namespace tutti::lidar
