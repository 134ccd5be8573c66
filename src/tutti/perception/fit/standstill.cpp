// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/standstill.hpp"

#include <algorithm>
#include <optional>

#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::fit {
namespace {

constexpr double kLeastDistance_m = 0.3, kLeastTurn_deg = 5.0;
constexpr double kStill_m = 0.01, kStill_rad = 0.1 * kRadPerDeg;
constexpr double kStillShare = 0.05;  // of what the scans show
constexpr double kSureDistance2 = 36.0;

/// The scans surely show another motion.
bool contradicts(const ScanStep& step, const Pose3& by_odometry) {
  const Vector6d difference = local(by_odometry, step.T_from_to);
  return squared_distance(difference, step.covariance) >= kSureDistance2;
}

bool stands(const ScanStep& step, const Pose3& by_odometry) {
  const Pose3& scans = step.T_from_to;
  return by_odometry.translation.norm() <= std::max(kStill_m, kStillShare * scans.translation.norm()) &&
         rotation_angle(by_odometry) <= std::max(kStill_rad, kStillShare * rotation_angle(scans));
}

/// The steps over which odometry stands while the scans move, and those beside them in which it began or ended to.
std::vector<bool> are_standstills(std::span<const ScanStep> steps, const Trajectory& odometry) {
  std::vector<bool> contradict(steps.size()), stand(steps.size());
  for (std::size_t k = 0; k < steps.size(); ++k)
    if (const auto motion = motion_over(steps[k], odometry)) {
      contradict[k] = contradicts(steps[k], *motion);
      stand[k] = contradict[k] && stands(steps[k], *motion);
    }
  std::vector<bool> out = stand;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const bool after = k > 0 && stand[k - 1] && steps[k - 1].to == steps[k].from;
    const bool before = k + 1 < steps.size() && stand[k + 1] && steps[k].to == steps[k + 1].from;
    out[k] = stand[k] || (contradict[k] && (after || before));
  }
  return out;
}

}  // namespace

std::vector<Misfit> find_standstills(std::span<const ScanStep> steps, const Trajectory& odometry,
                                     std::vector<ScanStep>& moving) {
  std::vector<Misfit> out;
  std::optional<Misfit> open;
  const auto close = [&] {
    if (open && (open->value >= kLeastDistance_m || open->angle_deg >= kLeastTurn_deg)) out.push_back(*open);
    open.reset();
  };
  const std::vector<bool> is_standstill = are_standstills(steps, odometry);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const ScanStep& step = steps[k];
    if (!is_standstill[k]) {
      close();
      moving.push_back(step);
      continue;
    }
    if (open && open->to != step.from) close();
    if (!open) open = Misfit{.kind = MisfitKind::stood_still, .from = step.from};
    open->value += step.T_from_to.translation.norm();
    open->angle_deg += rotation_angle(step.T_from_to) / kRadPerDeg;
    open->to = step.to;
  }
  close();
  return out;
}

}  // namespace tutti::fit
