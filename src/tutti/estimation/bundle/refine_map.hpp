// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/estimation/bundle/bundle_adjuster.hpp"
#include "tutti/estimation/bundle/guided_matches.hpp"
#include "tutti/estimation/bundle/imu_trial.hpp"
#include "tutti/estimation/bundle/landmark_merge.hpp"
#include "tutti/estimation/bundle/stereo_scale.hpp"

namespace tutti::bundle {

struct RefinementConfig {
  GuidedMatchConfig matching;
  MergeConfig merge;
  BundleConfig bundle;
  StereoConfig stereo;
  template <class V>
  void describe(V& v) {
    v.field("merge", merge);
    v.field("bundle", bundle);
    v.field("stereo", stereo);
  }
};

struct RefinementInput {
  /// Any robots' submaps; one without a visual payload contributes its odometry alone.
  std::vector<PosedSubmap> submaps;
  /// Pairs tied by accepted closures, in which guided_matches() finds common landmarks.
  std::vector<SubmapPair> closed;
  std::vector<LandmarkMatch> matches;  ///< Further landmarks that are known to be common.
};

/// A factor that replaces an odometry factor of the pose graph.
struct RelativeFactor {
  KeyframeId from;
  KeyframeId to;             ///< The keyframe after `from`.
  RelativePose measurement;  ///< T_from_to with the covariance of the joint posterior.
};

/// The result of refine_map(). A worker's tutti::Refinement carries the part of it that the server uses.
struct RefinedMap {
  std::vector<BundleKeyframe> keyframes;  ///< Sorted by id.
  /// From every keyframe to the next one of its submap, unless both are constant; sorted by id.
  std::vector<RelativeFactor> factors;
  std::vector<Eigen::Vector3d> landmarks;         ///< World frame, m.
  std::vector<CameraResiduals> residuals_before;  ///< MergedMap::residuals.
  std::vector<CameraResiduals> residuals_after;
  double rms_before_px = 0.0;  ///< All views of the adjusted problem but those of landmarks behind their camera.
  double rms_after_px = 0.0;
  std::vector<ImuRun> imu;
  std::vector<StereoScale> stereo;
  MergeSummary merge;
  AdjustmentSummary adjustment;
};

/// Adjusts the submaps' keyframes and landmarks in one bundle adjustment that starts from the given poses. A component
/// with constant submaps is fixed by them: it has no other gauge, and its covariances are conditional on their poses.
/// Factors between keyframes that see no landmark, and all factors when the adjustment fails, are those of the
/// odometry. A pure function; the order of submaps and matches does not matter. Errors (ErrorCode::invalid) name input
/// that is not finite or contradicts itself.
Result<RefinedMap> refine_map(const RefinementInput& input, const RefinementConfig& config);

}  // namespace tutti::bundle
