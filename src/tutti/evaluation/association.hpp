// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::evaluation {

/// The poses of one body by both trajectories at one time.
struct PosePair {
  Timestamp stamp;  ///< The estimate's.
  Pose3 estimate;   ///< T_estimate_body
  Pose3 reference;  ///< T_reference_body
};

struct AssociationConfig {
  bool interpolate = true;
  double max_gap_s = 0.2;
  double max_difference_s = 0.02;

  template <class V>
  void describe(V& v) {
    v.field("interpolate", interpolate, any(),
            "true: interpolate the reference at the estimate's stamps; false: take the nearest reference stamp.");
    v.field("max_gap_s", max_gap_s, at_least(0.0), "Interpolate only between reference poses this close in time.");
    v.field("max_difference_s", max_difference_s, at_least(0.0),
            "Without interpolation: largest difference between the two stamps.");
  }
};

/// Pairs every pose of the estimate with at most one pose of the reference, in the estimate's order; poses without a
/// partner are left out. With config.interpolate a pose has a partner when its stamp equals a reference stamp or lies
/// between two that are at most max_gap_s apart. Without, the partner is the pose of the nearest reference stamp (the
/// earlier of two equally near) within max_difference_s; one reference pose may then be the partner of several poses.
/// Both trajectories have increasing stamps.
std::vector<PosePair> associate(const Trajectory& estimate, const Trajectory& reference,
                                const AssociationConfig& config = {});

}  // namespace tutti::evaluation
