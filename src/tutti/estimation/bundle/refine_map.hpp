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
    v.field("matching", matching);
    v.field("merge", merge);
    v.field("bundle", bundle);
    v.field("stereo", stereo);
  }
};

struct RefinementInput {
  std::vector<PosedSubmap> submaps;    ///< Of any robots; those without a payload count by their odometry alone.
  std::vector<SubmapPair> closed;      ///< Tied by accepted closures: guided_matches() says which landmarks are one.
  std::vector<LandmarkMatch> matches;  ///< Further ones that are known to be one thing.
};

/// What takes the place of a pose graph's odometry factor.
struct RelativeFactor {
  KeyframeId from;
  KeyframeId to;             ///< The keyframe after it.
  RelativePose measurement;  ///< T_from_to with the covariance of the joint posterior.
};

struct Refinement {
  std::vector<BundleKeyframe> keyframes;          ///< By id.
  std::vector<RelativeFactor> factors;            ///< By id: from every keyframe to the next one of its submap, where
                                                  ///< not both are constant.
  std::vector<Eigen::Vector3d> landmarks;         ///< World frame, m.
  std::vector<CameraResiduals> residuals_before;  ///< MergedMap::residuals: of the submaps as they came.
  std::vector<CameraResiduals> residuals_after;
  double rms_before_px = 0.0;  ///< Of the adjusted problem's views, without those that no pixel sees.
  double rms_after_px = 0.0;
  std::vector<ImuRun> imu;
  std::vector<StereoScale> stereo;
  MergeSummary merge;
  AdjustmentSummary adjustment;
};

/// The submaps' keyframes and landmarks in one bundle adjustment, starting from the poses given. Constant submaps hold
/// the others: with such a neighbour a component has no other gauge, and covariances are those given its poses. A pure
/// function; the order of submaps and matches does not matter. Non-finite and contradictory input is refused by name.
/// Between keyframes that see nothing, and everywhere when the adjustment fails, factors are those of the odometry.
Result<Refinement> refine_map(const RefinementInput& input, const RefinementConfig& config);

}  // namespace tutti::bundle
