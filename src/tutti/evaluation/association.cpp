// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/association.hpp"

#include <cmath>
#include <optional>

namespace tutti::evaluation {
namespace {

using Iterator = Trajectory::const_iterator;

/// `after` is the first reference pose not before the stamp.
std::optional<Pose3> interpolated(const Trajectory& reference, Iterator after, Timestamp stamp, double max_gap_s) {
  if (after == reference.end()) return std::nullopt;
  if (after->stamp == stamp) return after->pose;
  if (after == reference.begin()) return std::nullopt;
  const Iterator before = after - 1;
  const double gap_s = after->stamp - before->stamp;
  if (gap_s > max_gap_s) return std::nullopt;
  return interpolate(before->pose, after->pose, (stamp - before->stamp) / gap_s);
}

std::optional<Pose3> nearest(const Trajectory& reference, Iterator after, Timestamp stamp, double max_difference_s) {
  if (reference.empty()) return std::nullopt;
  Iterator best = after;
  if (after == reference.end() || (after != reference.begin() && stamp - (after - 1)->stamp <= after->stamp - stamp))
    best = after - 1;
  if (std::abs(best->stamp - stamp) > max_difference_s) return std::nullopt;
  return best->pose;
}

}  // namespace

std::vector<PosePair> associate(const Trajectory& estimate, const Trajectory& reference,
                                const AssociationConfig& config) {
  std::vector<PosePair> pairs;
  Iterator after = reference.begin();
  for (const StampedPose& pose : estimate) {
    while (after != reference.end() && after->stamp < pose.stamp) ++after;
    const auto match = config.interpolate ? interpolated(reference, after, pose.stamp, config.max_gap_s)
                                          : nearest(reference, after, pose.stamp, config.max_difference_s);
    if (match) pairs.push_back({pose.stamp, pose.pose, *match});
  }
  return pairs;
}

}  // namespace tutti::evaluation
