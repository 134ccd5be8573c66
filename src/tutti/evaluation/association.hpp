// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::evaluation {

/// One body seen by both trajectories at one moment.
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

/// At most one pair per pose of the estimate, in its order. Interpolating, a pose pairs when its stamp equals a
/// reference stamp or lies between two at most max_gap_s apart; otherwise when the nearest reference stamp (the earlier
/// of two equally near) is within max_difference_s, and then one reference pose may serve several poses.
std::vector<PosePair> associate(const Trajectory& estimate, const Trajectory& reference,
                                const AssociationConfig& config = {});

}  // namespace tutti::evaluation
