// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/steady_drift.hpp"

#include <algorithm>
#include <cmath>

#include "tutti/geometry/so3.hpp"

namespace tutti::fit {
namespace {

constexpr double kShortest_m = 3.0;
constexpr double kMostDrift = 3.0 * kRadPerDeg;          // per metre; more is no drift
constexpr double kWander = 0.1 * kRadPerDeg;             // that honest odometry wanders by, per root of a metre
constexpr double kLeastTaken = 0.1 * kRadPerDeg;         // per metre, that is taken out
constexpr double kSureSigmas = 4.0, kAboveSigmas = 2.0;  // from no drift, and from kLeastTaken
constexpr double kForgets = 0.95;  // wheels wear and floors change: a submap counts this much when the next one ends

}  // namespace

void SteadyDrift::add(const ScanStep& far, const Pose3& T_by_odometry, double distance_m, double other_rad2) {
  if (distance_m < kShortest_m) return;
  const double turn = so3_log(far.T_from_to.rotation.conjugate() * T_by_odometry.rotation).z();
  const double z = turn / distance_m;
  if (std::abs(z) > kMostDrift) return;
  const double variance =
      (far.covariance(5, 5) + other_rad2 + kWander * kWander * distance_m) / (distance_m * distance_m);
  for (double* sum : {&weight, &value, &square, &count}) *sum *= kForgets;
  weight += 1.0 / variance;
  value += z / variance;
  square += z * z / variance;
  count += 1.0;
}

std::optional<SteadyDrift::Estimate> SteadyDrift::estimate() const {
  if (weight <= 0.0) return std::nullopt;
  const double mean = value / weight;
  const double scatter = std::max(0.0, square - mean * value) / std::max(1.0, count - 1.0);
  return Estimate{mean, std::sqrt(std::max(1.0, scatter) / weight)};
}

double SteadyDrift::to_take_out() const {
  const auto now = estimate();
  if (!now) return 0.0;
  const double least = std::max(kSureSigmas * now->sigma, kLeastTaken + kAboveSigmas * now->sigma);
  return std::abs(now->rad_per_m) >= least ? now->rad_per_m : 0.0;
}

Pose3 without_drift(const Pose3& motion, double distance_m, double rad_per_m) {
  const Eigen::Quaterniond half = so3_exp({0.0, 0.0, -0.5 * rad_per_m * distance_m});
  return {(half * motion.rotation * half).normalized(), half * motion.translation};
}

}  // namespace tutti::fit
