// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "tutti/geometry/pose3.hpp"

namespace tutti::estimation {

/// Where the rest of the map sees a pose of a chain: a closure to it from a pose that the map knows.
struct PoseSighting {
  std::size_t at = 0;  ///< Pose of the chain.
  Pose3 T_world_body;
  Matrix6d covariance;  ///< Right tangent.
};

/// Poses of a chain between which its odometry failed, and what it missed in all (at least 0.1 m and 0.5 degrees), seen
/// from where on the chain the translation is least.
struct FailureInterval {
  std::size_t from = 0;
  std::size_t to = 0;
  double missed_m = 0.0;
  double missed_rad = 0.0;
};

/// Where on a chain odometry failed, given that it did, once. Every interval is weighed by its evidence: outside it
/// odometry is trusted, inside it errs by nearly the same per metre, of a size that goes with what was missed in all;
/// a sighting either fits or is wrong, at a bounded cost; longer intervals are less likely. Returned are the median
/// begin and the median end of the intervals that overlap the most likely one. Filters run forward, backward, and from
/// every begin: at most 61 of them over all sighted poses and some 60 more.
/// `sightings`: by pose; the first one, of the first pose, and the last one, of the last pose, are believed. Nothing
/// when there are fewer than 3 poses.
std::optional<FailureInterval> locate_failure(std::span<const Pose3> T_odom_body,
                                              std::span<const Matrix6d> step_covariance,
                                              std::span<const PoseSighting> sightings);

}  // namespace tutti::estimation
