// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/mend_submap.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/perception/fit/image_step.hpp"
#include "tutti/perception/fit/sparse_scans.hpp"
#include "tutti/perception/fit/standstill.hpp"
#include "tutti/perception/fit/steady_drift.hpp"

namespace tutti::robot {
namespace {

constexpr double kLongestStep_s = 3.0;  // between two scans, or two images
constexpr double kNearTimes = 4.0;      // of its variance that a step from scan to scan may miss odometry by

const Pose3* at(const Trajectory& poses, Timestamp stamp) {
  const auto found = std::ranges::lower_bound(poses, stamp, {}, &StampedPose::stamp);
  return found != poses.end() && found->stamp == stamp ? &found->pose : nullptr;
}

/// T_submap_body at all keyframes and scans in time, by odometry.
Trajectory poses_of(const FinishedSubmap& finished) {
  Trajectory out;
  for (const lidar::PosedCloud& scan : finished.scans) out.push_back({scan.stamp, scan.T_submap_body});
  if (finished.scan_after) out.push_back({finished.scan_after->stamp, finished.scan_after->T_submap_body});
  const Pose3 T_submap_odom = finished.submap.keyframes.front().T_odom_body.inverse();
  for (const Keyframe& keyframe : finished.submap.keyframes)
    out.push_back({keyframe.stamp, T_submap_odom * keyframe.T_odom_body});
  std::ranges::stable_sort(out, {}, &StampedPose::stamp);
  const auto twice = std::ranges::unique(out, {}, &StampedPose::stamp);
  out.erase(twice.begin(), twice.end());
  return out;
}

/// The steps during which odometry stood still, by the time at which they end.
std::map<Timestamp, const fit::ScanStep*> still_steps(const std::vector<fit::ScanStep>& steps,
                                                      const Trajectory& poses) {
  std::vector<fit::ScanStep> moving;
  const std::vector<fit::Misfit> standstills = fit::find_standstills(steps, poses, moving);
  std::map<Timestamp, const fit::ScanStep*> out;
  for (const fit::ScanStep& step : steps)
    if (std::ranges::any_of(standstills,
                            [&](const fit::Misfit& still) { return still.from <= step.from && step.to <= still.to; }))
      out.emplace(step.to, &step);
  return out;
}

Trajectory mended(const Trajectory& poses, const std::map<Timestamp, const fit::ScanStep*>& still, double drift) {
  Trajectory out{poses.front()};
  for (std::size_t k = 1; k < poses.size(); ++k) {
    const Pose3 motion = poses[k - 1].pose.inverse() * poses[k].pose;
    Pose3 pose = out.back().pose * fit::without_drift(motion, motion.translation.norm(), drift);
    if (const auto step = still.find(poses[k].stamp); step != still.end())
      pose = *at(out, step->second->from) * step->second->T_from_to;
    out.push_back({poses[k].stamp, pose});
  }
  return out;
}

/// From the first scan to `last`, by registration from where the steps in between lead, if they all are known.
void add_far_step(const fit::FitScan& first, const fit::FitScan& last, const Trajectory& poses, SubmapSteps& out) {
  const Pose3 *from = at(poses, first.stamp), *to = at(poses, last.stamp);
  out.T_far_by_odometry = from->inverse() * *to;
  out.far_distance_m = 0.0;
  for (std::size_t k = 1; k < poses.size(); ++k)
    if (poses[k - 1].stamp >= first.stamp && poses[k].stamp <= last.stamp)
      out.far_distance_m += (poses[k].pose.translation - poses[k - 1].pose.translation).norm();
  Pose3 T_by_steps;
  Timestamp until = first.stamp;
  double missed_rad2 = 0.0, expected_rad2 = 0.0, missed_m2 = 0.0, expected_m2 = 0.0;
  for (const fit::ScanStep& step : out.near) {
    if (until == last.stamp) break;
    if (step.from != until) return;
    T_by_steps = T_by_steps * step.T_from_to;
    until = step.to;
    const Pose3 by_odometry = at(poses, step.from)->inverse() * *at(poses, step.to);
    missed_rad2 += std::pow(so3_log(step.T_from_to.rotation.conjugate() * by_odometry.rotation).z(), 2);
    expected_rad2 += kNearTimes * step.covariance(5, 5);
    missed_m2 += (step.T_from_to.translation - by_odometry.translation).squaredNorm();
    expected_m2 += kNearTimes * step.covariance.topLeftCorner<3, 3>().trace();
  }
  out.other_rad2 = std::max(0.0, missed_rad2 - expected_rad2);
  if (until == last.stamp && missed_m2 <= expected_m2)  // else there is more wrong than a drift
    out.far = fit::step_between(first, last, T_by_steps, out.T_far_by_odometry);
}

void add_scan_steps(const FinishedSubmap& finished, double min_range_m, SubmapSteps& out) {
  std::optional<fit::FitScan> first, middle, last;
  Pose3 T_submap_last;
  const auto add = [&](const lidar::PosedCloud& scan) {
    fit::FitScan seen = fit::make_fit_scan(scan.stamp, *scan.cloud, min_range_m);
    const double duration_s = last ? scan.stamp - last->stamp : 0.0;
    if (duration_s > 0.0 && duration_s <= kLongestStep_s) {
      const Pose3 T_as_before = out.near.empty() ? Pose3{} : fit::steady_motion(out.near.back(), duration_s);
      if (const auto step = fit::step_between(*last, seen, T_submap_last.inverse() * scan.T_submap_body, T_as_before))
        out.near.push_back(*step);
    }
    if (!first) first = seen;
    if (out.near.size() == finished.scans.size() / 2) middle = seen;
    last = std::move(seen);
    T_submap_last = scan.T_submap_body;
  };
  for (const lidar::PosedCloud& scan : finished.scans) add(scan);
  if (finished.scan_after) add(*finished.scan_after);
  if (out.near.size() < 2) {
    out.still_m = fit::moved_while_still(finished.scans);
    return;
  }
  const Trajectory poses = poses_of(finished);
  add_far_step(*first, *last, poses, out);
  if (!out.far && middle) add_far_step(*first, *middle, poses, out);  // round a corner nothing is seen of both
}

}  // namespace

SubmapSteps steps_of(const FinishedSubmap& finished, double min_range_m) {
  SubmapSteps out;
  add_scan_steps(finished, min_range_m, out);
  for (std::size_t k = 1; k < finished.images.size(); ++k) {
    const TrackedImages &from = finished.images[k - 1], &to = finished.images[k];
    if (to.stamp - from.stamp > kLongestStep_s) continue;
    if (const auto step = fit::step_between(from, to)) out.by_images.push_back(*step);
  }
  return out;
}

std::optional<Pose3> mend(const SubmapSteps& steps, double drift, FinishedSubmap& finished) {
  const Trajectory poses = poses_of(finished);
  const auto still = still_steps(steps.best(), poses);
  if (still.empty() && drift == 0.0) return std::nullopt;
  const Trajectory right = mended(poses, still, drift);
  for (lidar::PosedCloud& scan : finished.scans) scan.T_submap_body = *at(right, scan.stamp);
  Submap& submap = finished.submap;
  const Pose3 T_odom_submap = submap.keyframes.front().T_odom_body;
  for (Keyframe& keyframe : submap.keyframes) keyframe.T_odom_body = T_odom_submap * *at(right, keyframe.stamp);
  for (std::size_t k = 0; k < submap.odometry.size(); ++k) {
    RelativePose& step = submap.odometry[k];
    step.T_a_b = submap.keyframes[k].T_odom_body.inverse() * submap.keyframes[k + 1].T_odom_body;
    const auto stood = still.upper_bound(submap.keyframes[k].stamp);
    if (stood != still.end() && stood->first <= submap.keyframes[k + 1].stamp)
      step.covariance = bounded_covariance(stood->second->covariance);
  }
  return T_odom_submap * right.back().pose * poses.back().pose.inverse() * T_odom_submap.inverse();
}

}  // namespace tutti::robot
