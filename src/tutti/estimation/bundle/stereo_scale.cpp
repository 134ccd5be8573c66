// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/bundle/stereo_scale.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "tutti/estimation/bundle/path_scale.hpp"

namespace tutti::bundle {
namespace {

std::set<RobotId> robots_with_several(const BundleProblem& problem) {
  std::map<RobotId, std::set<std::uint32_t>> cameras;
  for (const BundleObservation& view : problem.observations) {
    const BundleCamera& camera = problem.cameras[view.camera];
    cameras[camera.robot].insert(camera.index);
  }
  std::set<RobotId> out;
  for (const auto& [robot, indices] : cameras)
    if (indices.size() > 1) out.insert(robot);
  return out;
}

/// The problem of the robot's images without anybody else's, and without the lengths of its odometry.
BundleProblem alone(const BundleProblem& problem, RobotId robot) {
  BundleProblem out = problem;
  out.imu.clear();
  for (BundleKeyframe& keyframe : out.keyframes) keyframe.is_constant = false;
  std::erase_if(out.observations, [&](const auto& view) { return out.cameras[view.camera].robot != robot; });
  std::erase_if(out.odometry, [&](const auto& step) { return out.keyframes[step.from].id.chain.robot != robot; });
  for (BundleOdometry& step : out.odometry) {
    const Eigen::Vector3d t = step.measurement.T_a_b.translation;  // free by all of its length, in both directions
    step.measurement.covariance.topLeftCorner<3, 3>() += t * t.transpose();
  }
  return out;
}

/// Steps weigh by how well the images know their length: those that no image spans have no weight.
std::optional<StereoScale> compared(const BundleProblem& own, const std::vector<RelativePose>& odometry,
                                    const BundleSolution& solution, const Posterior& posterior,
                                    const BundleConfig& bundle, const StereoConfig& config) {
  const auto covariances = posterior.steps();
  if (!covariances) return std::nullopt;
  std::vector<ComparedStep> steps;
  double weights_m2 = 0.0, variance_m2 = 0.0;
  for (std::size_t e = 0; e < own.odometry.size(); ++e) {
    const Eigen::Vector3d t = odometry[e].T_a_b.translation;
    const Eigen::Vector3d in_body = odometry[e].T_a_b.rotation.conjugate() * t;  // tangents are of the step's end
    const auto along_m4 = [&](const Matrix6d& C) { return in_body.dot(C.topLeftCorner<3, 3>() * in_body); };
    const double seen_m4 = along_m4((*covariances)[e]), stated_m4 = along_m4(odometry[e].covariance);
    if (!(seen_m4 + stated_m4 > 0.0)) continue;
    const double weight = t.squaredNorm() / (seen_m4 + stated_m4);
    steps.push_back({own.odometry[e].from, own.odometry[e].to, t, weight});
    weights_m2 += weight * t.squaredNorm();
    variance_m2 += weight * weight * stated_m4;
  }
  const PathScale fit = path_scale(steps, solution, posterior);
  if (!(fit.length_m > 0.0)) return std::nullopt;
  StereoScale out{.robot = own.keyframes[own.odometry.front().from].id.chain.robot, .ratio = fit.scale};
  const double odometry_sigma = bundle.odometry_scale_sigma * fit.scale;
  out.sigma = std::sqrt(fit.variance + variance_m2 / (weights_m2 * weights_m2) + odometry_sigma * odometry_sigma);
  const bool is_contradicted = std::abs(out.ratio - 1.0) > config.max_sigmas * out.sigma;
  out.is_corrected = is_contradicted && config.contradicted == "correct" && out.ratio > 0.0;
  out.is_refused = is_contradicted && !out.is_corrected;
  return out;
}

std::uint32_t first_camera(RobotId robot, const BundleProblem& problem) {
  std::uint32_t first = ~std::uint32_t{0};
  for (const BundleCamera& camera : problem.cameras)
    if (camera.robot == robot) first = std::min(first, camera.index);
  return first;
}

void keep_first_camera(RobotId robot, BundleProblem& problem) {
  const std::uint32_t first = first_camera(robot, problem);
  std::erase_if(problem.observations, [&](const BundleObservation& view) {
    const BundleCamera& camera = problem.cameras[view.camera];
    return camera.robot == robot && camera.index != first;
  });
  // A landmark with one view left measures nothing, and no pose constrains it.
  std::vector<std::set<std::size_t>> seen_from(problem.landmarks.size());
  for (const BundleObservation& view : problem.observations) seen_from[view.landmark].insert(view.keyframe);
  std::erase_if(problem.observations, [&](const auto& view) { return seen_from[view.landmark].size() < 2; });
}

void divide_baselines(RobotId robot, double ratio, BundleProblem& problem) {
  const std::uint32_t first = first_camera(robot, problem);
  const auto of_first = std::ranges::find_if(
      problem.cameras, [&](const BundleCamera& camera) { return camera.robot == robot && camera.index == first; });
  const Eigen::Vector3d origin = of_first->camera.T_body_camera.translation;
  for (BundleCamera& camera : problem.cameras)
    if (camera.robot == robot) {
      Eigen::Vector3d& t = camera.camera.T_body_camera.translation;
      t = origin + (t - origin) / ratio;
    }
}

}  // namespace

Result<std::vector<StereoScale>> judge_stereo(BundleProblem& problem, const std::vector<RelativePose>& odometry,
                                              const BundleConfig& config, const StereoConfig& stereo) {
  std::vector<StereoScale> out;
  const auto adjuster = make_ceres_bundle_adjuster(config);
  for (const RobotId robot : robots_with_several(problem)) {
    const BundleProblem own = alone(problem, robot);
    std::vector<RelativePose> its;
    for (std::size_t e = 0; e < problem.odometry.size(); ++e)
      if (problem.keyframes[problem.odometry[e].from].id.chain.robot == robot) its.push_back(odometry[e]);
    if (its.empty()) continue;
    const auto solution = adjuster->adjust(own);
    if (!solution) return tl::unexpected(solution.error());
    if (!estimation::is_usable(solution->summary.termination)) continue;
    const auto posterior = Posterior::of(own, *solution, config);
    if (!posterior) continue;
    if (const auto scale = compared(own, its, *solution, *posterior, config, stereo)) out.push_back(*scale);
  }
  for (const StereoScale& scale : out) {
    if (scale.is_refused) keep_first_camera(scale.robot, problem);
    if (scale.is_corrected) divide_baselines(scale.robot, scale.ratio, problem);
  }
  return out;
}

}  // namespace tutti::bundle
