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

/// Version of what extract_features(), plausible_pair(), verify_pair() and to_verdict() find. A commit that changes
/// their results, if only by a gate's default, raises it by hand: servers then ask again what another version answered.
inline constexpr std::uint32_t kVerifierVersion = 3;

/// Result of verify_pair(). The measured quantities are those of the best alignment, also when it is refused, as far as
/// they were measured: where a rival refuses a pair, the finest level is left out. Without any alignment they are 0.
struct PairVerification {
  bool accepted = false;
  std::optional<Refusal> refusal;  ///< Set when not accepted.
  Pose3 T_a_b;                     ///< Between the submap frames.
  /// Right tangent of T_a_b. For an accepted pair it includes how far both submaps may be bent, seen from their middle
  /// keyframes.
  Matrix6d covariance = Matrix6d::Identity();
  double overlap = 0.0;               ///< Mean of both directions.
  double plane_rmse_m = 0.0;          ///< The larger of both directions.
  double misfit = 0.0;                ///< The larger of both directions (registration.hpp).
  double min_eigenvalue = 0.0;        ///< The smaller of both directions.
  double viewpoint_distance_m = 0.0;  ///< Between the middle keyframes.
  double forward_backward_m = 0.0;  ///< Difference between registering a on b and b on a, at the centre of the overlap.
  double forward_backward_deg = 0.0;
  double contradiction = 0.0;  ///< Share of the points in view that lie where the other submap looked through.
  double rival_ratio = 0.0;    ///< Quality of the second best, distinct alignment over that of the best.
  double slid_ratio = 0.0;     ///< The same for alignments a few metres along the direction that is constrained least.
  double correlation_score = 0.0;
  std::vector<Refusal> evidence;  ///< Every gate's value and limit, when accepted.
};

/// Where `b` may lie on `a`, by the coarse levels of the registration.
struct RoughAlignment {
  Pose3 T_a_b;           ///< Between the submap frames.
  double quality = 0.0;  ///< In [0, 1]: overlap that nothing contradicts, less where it does not fit.
  double score = 0.0;    ///< Correlation of the views from above.
};

/// Distinct alignments, best first, upright and without the gates of verify_pair(); for less than half of its cost.
/// None for unusable submaps. config.registration.levels must not be empty.
std::vector<RoughAlignment> rough_alignments(const SubmapFeatures& a, const SubmapFeatures& b,
                                             const LidarClosureConfig& config);

/// Decides from the two submaps alone whether they show the same place. Those of two robots may be upside down to each
/// other. Computed in the order of the submap ids, so
/// verify_pair(b, a) is exactly the inverse. config.registration.levels must not be empty.
PairVerification verify_pair(const SubmapFeatures& a, const SubmapFeatures& b, const LidarClosureConfig& config);

/// For an operator who gives the relative pose of the two submaps: what verify_pair() measures, of the alignment that
/// registration reaches from `T_a_b`, without a check for rivals. Evidence and covariance are there also when a gate
/// refuses it; `accepted` then is false. Nothing of the two in reach of each other: no alignment.
PairVerification verify_near(const SubmapFeatures& a, const SubmapFeatures& b, const Pose3& T_a_b,
                             const LidarClosureConfig& config);

/// The same result for (b, a): T_b_a with its covariance.
PairVerification inverse(PairVerification verification);

/// The verdict of a pair. Its closure joins the middle keyframes, where bent submaps agree best; pair.first <
/// pair.second whatever the order of a and b. ClosureVerdict::verifier is left empty for the caller.
ClosureVerdict to_verdict(const Submap& a, const Submap& b, const PairVerification& verification);

}  // namespace tutti::lidar
