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

/// A submap at its place in the pose graph's map.
struct PosedSubmap {
  std::shared_ptr<const Submap> submap;
  std::vector<Pose3> T_world_body;  ///< Per keyframe of the submap.
  bool is_constant = false;         ///< Its keyframes keep these poses, also those that it shares.
};

/// A landmark, by the submap that carries it.
struct LandmarkId {
  SubmapId submap;
  std::uint32_t index = 0;  ///< Into VisualPayload::landmarks.
  friend auto operator<=>(const LandmarkId&, const LandmarkId&) = default;
};

/// Two landmarks that are one thing.
struct LandmarkMatch {
  LandmarkId one;
  LandmarkId other;
  friend auto operator<=>(const LandmarkMatch&, const LandmarkMatch&) = default;
};

struct MergeConfig {
  /// A view farther than this from where its landmark projects to, before the adjustment, is another thing.
  double max_reprojection_px = 20.0;
  double min_parallax_deg = 1.0;  ///< A landmark whose rays never differ by this much is too uncertain along them.
  int landmarks_per_keyframe = 150;
  /// Thinning: a keyframe whose landmarks nearly all have this many other views gives up its own; 0 = never.
  int redundant_views = 0;
  double odometry_sigma_m = 0.02;   ///< Added to the odometry's own covariance, per root of a second: odometry that is
                                    ///< too sure of itself bends the map, one that is too modest costs little.
  double odometry_sigma_deg = 0.3;  ///< The same of its rotation.
  bool use_imu = false;

  template <class V>
  void describe(V& v) {
    v.field("landmarks_per_keyframe", landmarks_per_keyframe, at_least(0),
            "Thinning: every keyframe keeps about this many of its landmarks, the best observed; 0 = all.");
    v.field("use_imu", use_imu, any(),
            "IMU factors where a payload has them: velocities, biases and gravity are estimated.");
  }
};

/// What became of the submaps' landmarks on their way into one problem.
struct MergeSummary {
  std::size_t landmarks_in = 0, views_in = 0;  ///< Of all payloads.
  std::size_t neighbour_joins = 0;             ///< Landmarks of neighbouring submaps with a keypoint in common.
  std::size_t closure_joins = 0;               ///< Landmarks joined by matches.
  std::size_t two_positions = 0;  ///< Joined landmarks that the submaps had apart by more than both claim (3 sigma).
  std::size_t two_things = 0;     ///< Joined landmarks whose views contradict it: taken apart again.
  std::size_t views_contradicting = 0;  ///< Views dropped by reprojection.
  std::size_t views_doubled = 0;        ///< The shared keyframe's views, which both submaps bring.
  std::size_t landmarks_uncertain = 0;  ///< Dropped: too few views, no parallax or behind a camera.
  std::size_t landmarks_thinned = 0;
  std::size_t redundant_keyframes = 0;
  std::size_t landmarks_out = 0, views_out = 0;  ///< Of the problem.
};

struct MergedMap {
  BundleProblem problem;
  std::vector<RelativePose> odometry;  ///< As the robots gave it, in the order of problem.odometry.
  /// Of the submaps as they came, before anything is merged: each one's landmarks from its own odometry's poses. A
  /// wrong calibration shows here.
  std::vector<CameraResiduals> residuals;
  MergeSummary summary;
};

/// One bundle problem from several submaps. Landmarks of neighbouring submaps of one chain become one when they have a
/// keypoint of the shared keyframe in common (same camera, same pixel: one ray), those of other submaps when a match
/// says so; what constant keyframes alone see is left out. What was joined is triangulated again along all its rays
/// from `T_world_body`, never averaged: two submaps put a landmark apart along the viewing ray. Views that contradict
/// are dropped; where most do, the join is undone. A pure function; the order of submaps and matches does not matter.
/// Refuses what does not fit together (a pose for every keyframe, indices in range, finite numbers), by name.
Result<MergedMap> merge_landmarks(std::span<const PosedSubmap> submaps, std::span<const LandmarkMatch> matches,
                                  const MergeConfig& config);

}  // namespace tutti::bundle
