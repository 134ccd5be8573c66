// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/fit_watch.hpp"

#include <algorithm>
#include <cmath>

#include "tutti/geometry/so3.hpp"
#include "tutti/perception/fit/odometry_fit.hpp"

namespace tutti::robot {
namespace {

constexpr double kFinest_s = 0.05;                 // between odometry samples that are kept
constexpr std::size_t kMostSamples = 20'000;       // of odometry: a robot may have no scans
constexpr std::size_t kRanges = 20;                // scans whose ranges are remembered
constexpr double kFarthest_m = 300.0;              // of half the points of a LiDAR
constexpr double kLeastDrift = 0.15 * kRadPerDeg;  // per metre, that is said
constexpr double kSaidAfter = 2.5;                 // submaps: a late clock may look like a drift in two
constexpr double kOtherSize = 0.5;                 // share by which a value has changed when it is said again

/// Standing says nothing of odometry, and would fill the memory.
bool stands(const fit::ScanStep& step, const Trajectory& odometry) {
  const auto is_small = [](const Pose3& T) {
    return T.translation.norm() < 0.05 && rotation_angle(T) < 1.0 * kRadPerDeg;
  };
  const auto by_odometry = fit::motion_over(step, odometry);
  return is_small(step.T_from_to) && by_odometry && is_small(*by_odometry);
}

double median_range_m(const PointCloud& cloud) {
  std::vector<float> ranges;
  ranges.reserve(cloud.points.size());
  for (const Eigen::Vector3f& p : cloud.points)
    if (p.allFinite()) ranges.push_back(p.norm());
  if (ranges.empty()) return 0.0;
  std::ranges::nth_element(ranges, ranges.begin() + std::ssize(ranges) / 2);
  return double{ranges[ranges.size() / 2]};
}

bool is_same(const fit::Misfit& a, const fit::Misfit& b) {
  if (!are_one(a, b)) return false;
  if (a.kind == fit::MisfitKind::stood_still) return true;
  return std::abs(a.value - b.value) <= kOtherSize * std::max(std::abs(a.value), std::abs(b.value));
}

}  // namespace

void FitWatch::add_odometry(const StampedPose& T_odom_body, bool is_jump) {
  if (!is_on_) return;
  if (is_jump) {
    odometry_.clear();
    steps_ = {};
  }
  const bool is_close = odometry_.size() >= 2 && T_odom_body.stamp - odometry_[odometry_.size() - 2].stamp < kFinest_s;
  if (is_close)
    odometry_.back() = T_odom_body;
  else
    odometry_.push_back(T_odom_body);
  if (odometry_.size() > kMostSamples) odometry_.erase(odometry_.begin(), odometry_.begin() + kMostSamples / 2);
}

void FitWatch::add(const FinishedSubmap& submap, const SubmapSteps& steps, const fit::SteadyDrift& drift) {
  if (!is_on_ || (submap.scans.empty() && steps.by_images.empty())) return;
  for (const lidar::PosedCloud& scan : submap.scans) {
    ranges_m_.push_back(median_range_m(*scan.cloud));
    if (ranges_m_.size() > kRanges) ranges_m_.pop_front();
  }
  if (steps.far) registrations_ += static_cast<std::uint64_t>(steps.far->registrations);
  keep(steps.near, fit::Witness::scans);
  keep(steps.by_images, fit::Witness::images);
  forget_old();
  compare(steps.still_m, drift);
}

void FitWatch::keep(std::span<const fit::ScanStep> steps, fit::Witness by) {
  std::vector<fit::ScanStep>& kept = steps_[static_cast<std::size_t>(by)];
  for (const fit::ScanStep& step : steps) {
    registrations_ += static_cast<std::uint64_t>(step.registrations);
    if (!stands(step, odometry_)) kept.push_back(step);
  }
  if (kept.size() > kMostSteps) kept.erase(kept.begin(), kept.end() - kMostSteps);
}

void FitWatch::forget_old() {
  if (odometry_.empty()) return;
  Timestamp oldest = odometry_.back().stamp;
  for (const auto& steps : steps_)
    if (!steps.empty()) oldest = std::min(oldest, steps.front().from);
  const auto kept = std::ranges::lower_bound(odometry_, oldest - fit::kMostOffset_s, {}, &StampedPose::stamp);
  odometry_.erase(odometry_.begin(), kept);
}

void FitWatch::compare(double still_m, const fit::SteadyDrift& drift) {
  const std::vector<fit::Misfit> before = std::exchange(misfits_, {});
  for (const fit::Witness by : {fit::Witness::scans, fit::Witness::images})
    for (fit::Misfit& misfit : fit::fit_odometry(steps_[static_cast<std::size_t>(by)], odometry_).misfits) {
      misfit.by = by;
      misfits_.push_back(std::move(misfit));
    }
  if (still_m > 0.0) misfits_.push_back({.kind = fit::MisfitKind::scans_stand_still, .value = still_m});
  std::vector<double> ranges(ranges_m_.begin(), ranges_m_.end());
  std::ranges::nth_element(ranges, ranges.begin() + std::ssize(ranges) / 2);
  if (ranges.size() == kRanges && ranges[kRanges / 2] > kFarthest_m)
    misfits_.push_back({.kind = fit::MisfitKind::far_points, .value = ranges[kRanges / 2]});
  const auto& scans = steps_[static_cast<std::size_t>(fit::Witness::scans)];
  if (const double turn = drift.to_take_out(); std::abs(turn) >= kLeastDrift && drift.count > kSaidAfter)
    misfits_.push_back({.kind = fit::MisfitKind::drift,
                        .value = turn / kRadPerDeg,
                        .sigma = drift.estimate()->sigma / kRadPerDeg,
                        .from = scans.empty() ? Timestamp{} : scans.front().from,
                        .to = scans.empty() ? Timestamp{} : scans.back().to});
  const auto is_in = [](const fit::Misfit& misfit, const std::vector<fit::Misfit>& list) {
    return std::ranges::any_of(list, [&](const fit::Misfit& other) { return is_same(other, misfit); });
  };
  for (const fit::Misfit& misfit : misfits_) {
    const bool is_standstill = misfit.kind == fit::MisfitKind::stood_still;
    const bool is_at_once = is_standstill || misfit.kind == fit::MisfitKind::scans_stand_still;
    if (is_in(misfit, said_) || (!is_at_once && !is_in(misfit, before))) continue;
    if (!is_standstill) std::erase_if(said_, [&](const fit::Misfit& said) { return are_one(said, misfit); });
    said_.push_back(misfit);
    news_.push_back(misfit);
  }
}

}  // namespace tutti::robot
