// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/geometry/pose3.hpp"
#include "tutti/perception/fit/scan_step.hpp"

namespace tutti::fit {

/// How far odometry turns too far to the left with every metre, rad/m, as scans that are a submap apart show it. From
/// one scan to the next a drift of wheels is far below what a registration errs by; over a submap it is above.
class SteadyDrift {
 public:
  /// `far` registers a submap's last scan on its first; odometry says T_by_odometry and a path of `distance_m` between
  /// the two. `other_rad2`: the variance of what else odometry's yaw is wrong by over this path. Over short paths, or
  /// where the two are nowhere near each other, nothing is learnt.
  void add(const ScanStep& far, const Pose3& T_by_odometry, double distance_m, double other_rad2 = 0.0);

  /// The estimate so far; the sigma is of the registrations, or of the values' scatter where that is larger.
  struct Estimate {
    double rad_per_m = 0.0, sigma = 0.0;
  };
  [[nodiscard]] std::optional<Estimate> estimate() const;
  /// The estimate where it is sure and large enough to matter, else 0: honest odometry is left alone.
  [[nodiscard]] double to_take_out() const;

  /// Sums over what was added: weights, weighted values, their weighted squares; and how many.
  double weight = 0.0, value = 0.0, square = 0.0, count = 0.0;
  friend bool operator==(const SteadyDrift&, const SteadyDrift&) = default;
};

/// Odometry's motion over a path of `distance_m` without the drift.
Pose3 without_drift(const Pose3& motion, double distance_m, double rad_per_m);

}  // namespace tutti::fit
