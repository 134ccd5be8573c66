// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/association.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "tutti/model/pose_at.hpp"

namespace tutti::evaluation {
namespace {

std::optional<Pose3> nearest(const Trajectory& reference, Timestamp stamp, double max_difference_s) {
  if (reference.empty()) return std::nullopt;
  const auto after = std::ranges::lower_bound(reference, stamp, {}, &StampedPose::stamp);
  auto best = after;
  if (after == reference.end() || (after != reference.begin() && stamp - (after - 1)->stamp <= after->stamp - stamp))
    best = after - 1;
  if (std::abs(best->stamp - stamp) > max_difference_s) return std::nullopt;
  return best->pose;
}

}  // namespace

std::vector<PosePair> associate(const Trajectory& estimate, const Trajectory& reference,
                                const AssociationConfig& config) {
  std::vector<PosePair> pairs;
  for (const StampedPose& pose : estimate) {
    const auto match = config.interpolate ? pose_at(reference, pose.stamp, config.max_gap_s)
                                          : nearest(reference, pose.stamp, config.max_difference_s);
    if (match) pairs.push_back({pose.stamp, pose.pose, *match});
  }
  return pairs;
}

}  // namespace tutti::evaluation
