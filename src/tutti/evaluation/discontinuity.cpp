// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/discontinuity.hpp"

#include "tutti/base/check.hpp"
#include "tutti/evaluation/association.hpp"
#include "tutti/evaluation/rpe.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::evaluation {
namespace {

void include(const PosePair& i, const PosePair& j, Discontinuity& largest) {
  const Pose3 raw = i.reference.inverse() * j.reference;
  const Pose3 corrected = i.estimate.inverse() * j.estimate;
  const double translation_m = (corrected.translation - raw.translation).norm();
  const double rotation_deg = rotation_angle(raw.inverse() * corrected) / kRadPerDeg;
  if (translation_m > largest.translation_m) {
    largest.translation_m = translation_m;
    largest.translation_at = i.stamp;
  }
  if (rotation_deg > largest.rotation_deg) {
    largest.rotation_deg = rotation_deg;
    largest.rotation_at = i.stamp;
  }
}

}  // namespace

std::optional<Discontinuity> discontinuity(const Trajectory& raw, const Trajectory& corrected, double delta_s) {
  TUTTI_CHECK(delta_s > 0.0, "delta_s = {}", delta_s);
  const auto pairs = associate(corrected, raw, {.interpolate = false, .max_difference_s = 0.0});
  if (pairs.size() < 2) return std::nullopt;
  Discontinuity largest{.translation_at = pairs.front().stamp, .rotation_at = pairs.front().stamp};
  std::size_t later = 0;
  for (std::size_t i = 0; i + 1 < pairs.size(); ++i) {
    include(pairs[i], pairs[i + 1], largest);
    while (later < pairs.size() && pairs[later].stamp - pairs[i].stamp < delta_s) ++later;
    if (later < pairs.size() && pairs[later].stamp - pairs[i].stamp <= (1.0 + kMaxOvershoot) * delta_s)
      include(pairs[i], pairs[later], largest);
  }
  return largest;
}

}  // namespace tutti::evaluation
