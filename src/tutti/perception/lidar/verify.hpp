// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/perception/lidar/closure_config.hpp"
#include "tutti/perception/lidar/submap_features.hpp"

namespace tutti::lidar {

/// Of what extract_features, plausible_pair, verify_pair and to_verdict make of two submaps. Raised by hand in the
/// commit that changes it, be it by a gate's default: servers then ask again what another version answered.
inline constexpr std::uint32_t kFinderVersion = 2;

/// What comparing two submaps found. The measured quantities are those of the best alignment, also when refused.
struct PairVerification {
  bool accepted = false;
  std::optional<Refusal> refusal;  ///< When not accepted.
  Pose3 T_a_b;                     ///< Between the submap frames.
  /// Right perturbation of T_a_b as the middle keyframes see the submaps: of an accepted pair how far these may be bent
  /// is in it.
  Matrix6d covariance = Matrix6d::Identity();
  double overlap = 0.0;               ///< Mean of both directions.
  double plane_rmse_m = 0.0;          ///< The larger of both directions.
  double misfit = 0.0;                ///< The larger of both directions (registration.hpp).
  double min_eigenvalue = 0.0;        ///< The smaller of both directions.
  double viewpoint_distance_m = 0.0;  ///< Between the middles of the two ways.
  double forward_backward_m = 0.0;    ///< At the centre of the overlap.
  double forward_backward_deg = 0.0;
  double contradiction = 0.0;  ///< Share of points in view that stand where the other submap looked through.
  double rival_ratio = 0.0;    ///< Quality of the second best alignment over that of the best.
  double slid_ratio = 0.0;     ///< The same, a few metres along the direction that is constrained least.
  double correlation_score = 0.0;
  std::vector<Refusal> evidence;  ///< When accepted: every gate's value and limit.
};

/// Decides from the two submaps alone whether they show the same place. Computed in the order of the submap ids, so
/// verify_pair(b, a) is exactly the inverse. config.registration.levels must not be empty.
PairVerification verify_pair(const SubmapFeatures& a, const SubmapFeatures& b, const LidarClosureConfig& config);

/// The other way round: T_b_a with its covariance.
PairVerification inverse(PairVerification verification);

/// The closure is expressed between the middle keyframes, where bent submaps agree best. pair.first < pair.second
/// whatever the order of a and b. Whose verdict it is, is not said.
ClosureVerdict to_verdict(const Submap& a, const Submap& b, const PairVerification& verification);

}  // namespace tutti::lidar
