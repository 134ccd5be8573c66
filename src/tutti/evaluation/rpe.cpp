// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/rpe.hpp"

#include <cmath>
#include <numbers>
#include <vector>

#include "tutti/base/check.hpp"

namespace tutti::evaluation {
namespace {

constexpr double kMaxOvershoot = 0.5;  // of the interval

/// E over all i, where `abscissa` says how far along pair i is (s or m), without decreasing.
std::optional<RpeResult> rpe(std::span<const PosePair> pairs, std::span<const double> abscissa, double delta) {
  TUTTI_CHECK(delta > 0.0, "delta = {}", delta);
  RpeResult result;
  double sum_m2 = 0.0;
  double sum_rad2 = 0.0;
  std::size_t j = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    while (j < pairs.size() && abscissa[j] - abscissa[i] < delta) ++j;
    if (j == pairs.size()) break;
    if (abscissa[j] - abscissa[i] > (1.0 + kMaxOvershoot) * delta) continue;
    const Pose3 step_reference = pairs[i].reference.inverse() * pairs[j].reference;
    const Pose3 step_estimate = pairs[i].estimate.inverse() * pairs[j].estimate;
    const Pose3 error = step_reference.inverse() * step_estimate;  // eq. 1
    sum_m2 += error.translation.squaredNorm();
    sum_rad2 += std::pow(rotation_angle(error), 2);
    ++result.count;
  }
  if (result.count == 0) return std::nullopt;
  const auto n = static_cast<double>(result.count);
  result.rmse_m = std::sqrt(sum_m2 / n);  // eq. 2
  result.rmse_deg = std::sqrt(sum_rad2 / n) * 180.0 / std::numbers::pi;
  return result;
}

}  // namespace

std::optional<RpeResult> rpe_over_time(std::span<const PosePair> pairs, double delta_s) {
  std::vector<double> seconds;
  for (const PosePair& pair : pairs) {
    seconds.push_back(pair.stamp - pairs.front().stamp);
    TUTTI_CHECK(seconds.size() < 2 || seconds.back() > seconds[seconds.size() - 2], "stamps of one robot increase");
  }
  return rpe(pairs, seconds, delta_s);
}

std::optional<RpeResult> rpe_over_distance(std::span<const PosePair> pairs, double delta_m) {
  std::vector<double> metres;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    metres.push_back(
        i == 0 ? 0.0 : metres.back() + (pairs[i].reference.translation - pairs[i - 1].reference.translation).norm());
  return rpe(pairs, metres, delta_m);
}

}  // namespace tutti::evaluation
