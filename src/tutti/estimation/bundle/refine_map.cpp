// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/refine_map.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "tutti/estimation/bundle/projection_factor.hpp"
#include "tutti/estimation/bundle/relative_covariances.hpp"

namespace tutti::bundle {
namespace {

/// The odometry factors' successors, in their order. Between two keyframes that see nothing it stays as it was, as it
/// does everywhere when the adjustment failed.
std::vector<RelativeFactor> factors_of(const MergedMap& merged, const BundleSolution& solution,
                                       const BundleConfig& config, const std::vector<StereoScale>& stereo) {
  const BundleProblem& problem = merged.problem;
  std::vector<bool> sees(problem.keyframes.size(), false);
  for (const auto& view : problem.observations) sees[view.keyframe] = true;
  std::optional<std::vector<Matrix6d>> covariances;
  if (estimation::is_usable(solution.summary.termination)) covariances = odometry_posterior(problem, solution, config);
  std::vector<RelativeFactor> out;
  for (std::size_t e = 0; e < problem.odometry.size(); ++e) {
    const auto& [from, to, measurement] = problem.odometry[e];
    if (problem.keyframes[from].is_constant && problem.keyframes[to].is_constant) continue;
    RelativePose refined = merged.odometry[e];
    if (covariances && (sees[from] || sees[to]))
      refined = {solution.T_world_body[from].inverse() * solution.T_world_body[to], (*covariances)[e]};
    // A baseline by the odometry's scale is as unsure as that, all along.
    const RobotId robot = problem.keyframes[from].id.chain.robot;
    for (const StereoScale& scale : stereo) {
      if (!scale.is_corrected || scale.robot != robot) continue;
      const Eigen::Vector3d t = refined.T_a_b.rotation.conjugate() * refined.T_a_b.translation;
      refined.covariance.topLeftCorner<3, 3>() += std::pow(scale.sigma / scale.ratio, 2) * t * t.transpose();
    }
    out.push_back({problem.keyframes[from].id, problem.keyframes[to].id, refined});
  }
  return out;
}

}  // namespace

Result<RefinedMap> refine_map(const RefinementInput& input, const RefinementConfig& config) {
  auto matches = guided_matches(input.submaps, input.closed, config.matching);
  matches.insert(matches.end(), input.matches.begin(), input.matches.end());
  auto merged = merge_landmarks(input.submaps, matches, config.merge);
  if (!merged) return tl::unexpected(merged.error());
  RefinedMap out;
  auto stereo = judge_stereo(merged->problem, merged->odometry, config.bundle, config.stereo);
  if (!stereo) return tl::unexpected(stereo.error());
  out.stereo = std::move(*stereo);
  auto solution = adjust_with_believed_imu(merged->problem, config.bundle, out.imu);
  if (!solution) return tl::unexpected(solution.error());

  out.rms_before_px = reprojection_rms_px(merged->problem);
  out.factors = factors_of(*merged, *solution, config.bundle, out.stereo);
  for (std::size_t k = 0; k < merged->problem.keyframes.size(); ++k)
    merged->problem.keyframes[k].T_world_body = solution->T_world_body[k];
  merged->problem.landmarks = std::move(solution->landmarks);
  out.residuals_before = std::move(merged->residuals);
  out.rms_after_px = reprojection_rms_px(merged->problem);
  out.residuals_after = camera_residuals(merged->problem);
  out.keyframes = std::move(merged->problem.keyframes);
  out.landmarks = std::move(merged->problem.landmarks);
  out.merge = merged->summary;
  out.adjustment = std::move(solution->summary);
  return out;
}

}  // namespace tutti::bundle
