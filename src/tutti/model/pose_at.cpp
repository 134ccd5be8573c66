// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/pose_at.hpp"

#include <algorithm>

namespace tutti {

std::optional<Pose3> pose_at(std::span<const StampedPose> trajectory, Timestamp stamp, double max_gap_s) {
  const auto after = std::ranges::lower_bound(trajectory, stamp, {}, &StampedPose::stamp);
  if (after == trajectory.end()) return std::nullopt;
  if (after->stamp == stamp) return after->pose;
  if (after == trajectory.begin()) return std::nullopt;
  const auto before = after - 1;
  const double gap_s = after->stamp - before->stamp;
  if (gap_s > max_gap_s) return std::nullopt;
  return interpolate(before->pose, after->pose, (stamp - before->stamp) / gap_s);
}

}  // namespace tutti
