// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/mend_submap.hpp"

#include <algorithm>
#include <iterator>
#include <optional>

#include "tutti/geometry/covariance.hpp"
#include "tutti/perception/fit/standstill.hpp"

namespace tutti::robot {
namespace {

constexpr double kLongestStep_s = 3.0;  // between two scans

/// From `from` on, what was T_submap_body is `left` * T_submap_body.
struct Mend {
  Timestamp from;
  Pose3 left;
  Matrix6d covariance;  // of the step that ends here
};

const Mend* at(const std::vector<Mend>& mends, Timestamp stamp) {
  const auto after = std::ranges::upper_bound(mends, stamp, {}, &Mend::from);
  return after == mends.begin() ? nullptr : &*std::prev(after);
}

/// The poses of all scans in time, to look motions up in.
Trajectory poses_of(std::span<const lidar::PosedCloud> scans, const std::optional<lidar::PosedCloud>& after) {
  Trajectory out;
  for (const lidar::PosedCloud& scan : scans) out.push_back({scan.stamp, scan.T_submap_body});
  if (after) out.push_back({after->stamp, after->T_submap_body});
  return out;
}

std::vector<Mend> mends_of(std::span<const fit::ScanStep> steps, const Trajectory& poses) {
  std::vector<fit::ScanStep> moving;
  const std::vector<fit::Misfit> standstills = fit::find_standstills(steps, poses, moving);
  const auto pose = [&](Timestamp stamp) {
    return std::ranges::lower_bound(poses, stamp, {}, &StampedPose::stamp)->pose;
  };
  std::vector<Mend> out;
  for (const fit::ScanStep& step : steps) {
    if (std::ranges::none_of(standstills,
                             [&](const fit::Misfit& still) { return still.from <= step.from && step.to <= still.to; }))
      continue;
    const Pose3 left = out.empty() ? Pose3{} : out.back().left;
    out.push_back({step.to, left * pose(step.from) * step.T_from_to * pose(step.to).inverse(), step.covariance});
  }
  return out;
}

}  // namespace

std::vector<fit::ScanStep> scan_steps(std::span<const lidar::PosedCloud> scans,
                                      const std::optional<lidar::PosedCloud>& after, double min_range_m) {
  std::vector<fit::ScanStep> out;
  std::optional<fit::FitScan> last;
  Pose3 T_submap_last;
  const auto add = [&](const lidar::PosedCloud& scan) {
    fit::FitScan seen = fit::make_fit_scan(scan.stamp, *scan.cloud, min_range_m);
    const double duration_s = last ? scan.stamp - last->stamp : 0.0;
    if (duration_s > 0.0 && duration_s <= kLongestStep_s) {
      const Pose3 T_as_before = out.empty() ? Pose3{} : fit::steady_motion(out.back(), duration_s);
      if (const auto step = fit::step_between(*last, seen, T_submap_last.inverse() * scan.T_submap_body, T_as_before))
        out.push_back(*step);
    }
    last = std::move(seen);
    T_submap_last = scan.T_submap_body;
  };
  for (const lidar::PosedCloud& scan : scans) add(scan);
  if (after) add(*after);
  return out;
}

std::optional<Pose3> mend_standstills(std::span<const fit::ScanStep> steps,
                                      const std::optional<lidar::PosedCloud>& after,
                                      std::vector<lidar::PosedCloud>& scans, Submap& submap) {
  const std::vector<Mend> mends = mends_of(steps, poses_of(scans, after));
  if (mends.empty()) return std::nullopt;
  for (lidar::PosedCloud& scan : scans)
    if (const Mend* mend = at(mends, scan.stamp)) scan.T_submap_body = mend->left * scan.T_submap_body;
  const Pose3 T_odom_submap = submap.keyframes.front().T_odom_body;
  const auto in_odom = [&](const Pose3& left) { return T_odom_submap * left * T_odom_submap.inverse(); };
  for (Keyframe& keyframe : submap.keyframes)
    if (const Mend* mend = at(mends, keyframe.stamp)) keyframe.T_odom_body = in_odom(mend->left) * keyframe.T_odom_body;
  for (std::size_t k = 0; k < submap.odometry.size(); ++k) {
    const Mend* mend = at(mends, submap.keyframes[k + 1].stamp);
    if (mend == nullptr || mend->from <= submap.keyframes[k].stamp) continue;
    submap.odometry[k] = {submap.keyframes[k].T_odom_body.inverse() * submap.keyframes[k + 1].T_odom_body,
                          bounded_covariance(mend->covariance)};
  }
  return in_odom(mends.back().left);
}

}  // namespace tutti::robot
