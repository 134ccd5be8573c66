// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/rpe.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "tutti/base/check.hpp"

namespace tutti::evaluation {
namespace {

/// E over all i, where `abscissa` is how far along pair i is (ns or m), without decreasing; j is the first pair at
/// least `least` after i, and none when that is more than `most`.
template <class T>
std::optional<RpeResult> rpe(std::span<const PosePair> pairs, const std::vector<T>& abscissa, T least, T most) {
  RpeResult result;
  double sum_m2 = 0.0;
  double sum_rad2 = 0.0;
  std::size_t j = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    while (j < pairs.size() && abscissa[j] - abscissa[i] < least) ++j;
    if (j == pairs.size()) break;
    if (abscissa[j] - abscissa[i] > most) continue;
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
  TUTTI_CHECK(delta_s > 0.0, "delta_s = {}", delta_s);
  std::vector<std::int64_t> ns;  // seconds would be rounded, and an interval of n samples now and then have n + 1
  for (const PosePair& pair : pairs) {
    ns.push_back(pair.stamp.ns - pairs.front().stamp.ns);
    TUTTI_CHECK(ns.size() < 2 || ns.back() > ns[ns.size() - 2], "stamps of one robot increase");
  }
  return rpe(pairs, ns, std::max<std::int64_t>(1, to_nanoseconds(delta_s)),
             to_nanoseconds((1.0 + kMaxOvershoot) * delta_s));
}

std::optional<RpeResult> rpe_over_distance(std::span<const PosePair> pairs, double delta_m) {
  constexpr double kRounding = 1e-9;  // of the interval: the distance is a sum
  TUTTI_CHECK(delta_m > 0.0, "delta_m = {}", delta_m);
  std::vector<double> metres;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    metres.push_back(
        i == 0 ? 0.0 : metres.back() + (pairs[i].reference.translation - pairs[i - 1].reference.translation).norm());
  return rpe(pairs, metres, (1.0 - kRounding) * delta_m, (1.0 + kMaxOvershoot + kRounding) * delta_m);
}

}  // namespace tutti::evaluation
