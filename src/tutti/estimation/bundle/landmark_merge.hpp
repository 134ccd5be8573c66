// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/estimation/bundle/bundle_problem.hpp"
#include "tutti/model/submap.hpp"

namespace tutti::bundle {

/// A submap with its keyframes' poses in the joint map.
struct PosedSubmap {
  std::shared_ptr<const Submap> submap;
  std::vector<Pose3> T_world_body;  ///< Per keyframe of the submap.
  bool is_constant = false;  ///< The adjustment keeps its keyframes fixed, also one that a neighbouring submap shares.
};

/// A landmark, by the submap that carries it.
struct LandmarkId {
  SubmapId submap;
  std::uint32_t index = 0;  ///< Into VisualPayload::landmarks.
  friend auto operator<=>(const LandmarkId&, const LandmarkId&) = default;
};

/// Two landmarks that are views of one point of the scene.
struct LandmarkMatch {
  LandmarkId one;
  LandmarkId other;
  friend auto operator<=>(const LandmarkMatch&, const LandmarkMatch&) = default;
};

struct MergeConfig {
  /// A view with a larger reprojection error, before the adjustment, is taken for one of another point.
  double max_reprojection_px = 20.0;
  /// A landmark whose viewing rays differ by less is dropped: its depth is too uncertain.
  double min_parallax_deg = 1.0;
  int landmarks_per_keyframe = 150;
  /// Thinning: a keyframe whose landmarks nearly all have this many other views gives up its own; 0 = never.
  int redundant_views = 0;
  double odometry_sigma_m = 0.02;   ///< Added to the odometry's stated covariance, per square root of a second:
                                    ///< overconfident odometry bends the map, modest odometry costs little.
  double odometry_sigma_deg = 0.3;  ///< As odometry_sigma_m, for the rotation.
  bool use_imu = false;

  template <class V>
  void describe(V& v) {
    v.field("landmarks_per_keyframe", landmarks_per_keyframe, at_least(0),
            "Thinning: every keyframe keeps about this many of its landmarks, the best observed; 0 = all.");
    v.field("use_imu", use_imu, any(),
            "IMU factors where a payload has them: velocities, biases and gravity are estimated.");
  }
};

/// Counts of what became of the submaps' landmarks in the merge.
struct MergeSummary {
  std::size_t landmarks_in = 0, views_in = 0;  ///< In all payloads.
  std::size_t neighbour_joins = 0;             ///< Landmarks of neighbouring submaps with a keypoint in common.
  std::size_t closure_joins = 0;               ///< Landmarks joined by matches.
  std::size_t two_positions = 0;  ///< Joined landmarks whose positions in the submaps differ by more than 3 sigma.
  std::size_t two_things = 0;     ///< Joined landmarks whose views contradict the join: separated again.
  std::size_t views_contradicting = 0;  ///< Views dropped by reprojection.
  /// Views of a shared keyframe, which both submaps bring: counted once in the problem.
  std::size_t views_doubled = 0;
  std::size_t landmarks_uncertain = 0;  ///< Dropped: too few views, no parallax or behind a camera.
  std::size_t landmarks_thinned = 0;
  std::size_t redundant_keyframes = 0;
  std::size_t landmarks_out = 0, views_out = 0;  ///< In the problem.
};

struct MergedMap {
  BundleProblem problem;
  /// The robots' odometry without the added sigmas, in the order of problem.odometry.
  std::vector<RelativePose> odometry;
  /// Reprojection errors before the merge: each submap's landmarks, seen from the poses of its own odometry.
  std::vector<CameraResiduals> residuals;
  MergeSummary summary;
};

/// Makes one bundle problem of several submaps. Landmarks of neighbouring submaps of one chain are joined when they
/// share a keypoint of the shared keyframe (same camera, same pixel: one ray), landmarks of other submaps when
/// `matches` joins them. Landmarks that only constant keyframes see are left out. A joined landmark is triangulated
/// again along all its rays from `T_world_body`, never averaged, because two submaps disagree along the viewing ray.
/// Views that contradict the new position are dropped; where most do, the join is undone. A pure function; the order of
/// submaps and matches does not matter. Errors (ErrorCode::invalid) name input that does not fit together: a keyframe
/// without pose, an index out of range, a number that is not finite.
Result<MergedMap> merge_landmarks(std::span<const PosedSubmap> submaps, std::span<const LandmarkMatch> matches,
                                  const MergeConfig& config);

}  // namespace tutti::bundle
