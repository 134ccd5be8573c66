// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/verifiers/bundle_refiner.hpp"

#include <fmt/format.h>

#include <map>
#include <utility>
#include <vector>

#include "tutti/verifiers/sensor_verifier_maker.hpp"

namespace tutti::verifiers {
namespace {

/// The job's submaps where it has them, with what their cameras saw.
Result<std::vector<bundle::PosedSubmap>> posed(const RefinementJob& job, const server::SubmapSet& submaps,
                                               const server::PayloadStore& payloads) {
  std::vector<bundle::PosedSubmap> out;
  for (const auto& [id, is_free, T_world_body] : job.parts) {
    const auto there = submaps.find(id);
    if (there == submaps.end()) return fail(ErrorCode::io, "submap {} is not there", to_string(id));
    auto payload = payloads.visual(id);
    if (!payload) return tl::unexpected(payload.error());
    auto submap = std::make_shared<Submap>(*there->second);
    submap->visual = std::move(*payload);
    out.push_back({std::move(submap), T_world_body, !is_free});
  }
  return out;
}

RefinementCounts counts_of(const bundle::RefinedMap& refined) {
  const bundle::MergeSummary& merge = refined.merge;
  return {.keyframes = refined.keyframes.size(),
          .landmarks = merge.landmarks_out,
          .observations = merge.views_out,
          .joined_by_keyframe = merge.neighbour_joins,
          .joined_by_closure = merge.closure_joins,
          .two_positions = merge.two_positions,
          .two_things = merge.two_things,
          .views_contradicting = merge.views_contradicting,
          .landmarks_uncertain = merge.landmarks_uncertain,
          .rms_before_px = refined.rms_before_px,
          .rms_after_px = refined.rms_after_px};
}

/// Reports for every robot how many of its IMU factors were left out, and why, by the worst of them.
void remark_on_imu(const std::vector<bundle::ImuRun>& runs, std::vector<RefinementRemark>& out) {
  struct LeftOut {
    std::size_t factors = 0, all = 0;
    bundle::ImuRun worst;
  };
  std::map<RobotId, LeftOut> by_robot;
  for (const bundle::ImuRun& run : runs) {
    LeftOut& left_out = by_robot[run.chain.robot];
    left_out.all += run.factors;
    if (!run.is_held_back) continue;
    left_out.factors += run.factors;
    if (run.factors > left_out.worst.factors) left_out.worst = run;
  }
  for (const auto& [robot, left_out] : by_robot) {
    if (left_out.factors == 0) continue;
    out.push_back(
        {robot, fmt::format("{} of {} IMU factors are held back: motion tells the accelerometer's bias to "
                            "{:.2f} m/s^2, and with them the trajectory is {:.3f} times as long as odometry and "
                            "images have it to {:.3f}",
                            left_out.factors, left_out.all, left_out.worst.bias_sigma_mps2, left_out.worst.scale,
                            left_out.worst.scale_sigma)});
  }
}

void remark_on_stereo(const std::vector<bundle::StereoScale>& scales, std::vector<RefinementRemark>& out) {
  for (const bundle::StereoScale& scale : scales) {
    if (!scale.is_refused && !scale.is_corrected) continue;
    out.push_back(
        {scale.robot,
         fmt::format(
             "its cameras together have its trajectory {:.3f} times as long as its odometry, +-{:.3f}: check the "
             "baseline, the rotation between the cameras and the focal lengths, the scale of depth images, or "
             "the odometry's scale; the adjustment {}",
             scale.ratio, scale.sigma,
             scale.is_refused ? "believes its first camera alone"
                              : fmt::format("divides the baseline by {:.3f}", scale.ratio))});
  }
}

std::vector<RefinementRemark> remarks_on(const bundle::RefinedMap& refined) {
  std::vector<RefinementRemark> out;
  remark_on_imu(refined.imu, out);
  remark_on_stereo(refined.stereo, out);
  return out;
}

}  // namespace

BundleRefiner::BundleRefiner(const bundle::RefinementConfig& config)
    : config_(config), settings_(settings_of(config)) {}

Result<Refinement> BundleRefiner::refine(const RefinementJob& job, const server::SubmapSet& submaps,
                                         const server::PayloadStore& payloads) const {
  auto parts = posed(job, submaps, payloads);
  if (!parts) return tl::unexpected(parts.error());
  const auto refined = bundle::refine_map({.submaps = std::move(*parts), .closed = job.closed, .matches = {}}, config_);
  if (!refined) return tl::unexpected(refined.error());
  Refinement out = answer_to(job);
  for (const bundle::RelativeFactor& factor : refined->factors) out.steps.push_back({factor.from, factor.measurement});
  for (const bundle::BundleKeyframe& keyframe : refined->keyframes)
    out.T_world_body.emplace(keyframe.id, keyframe.T_world_body);
  out.counts = counts_of(*refined);
  out.remarks = remarks_on(*refined);
  return out;
}

}  // namespace tutti::verifiers
