// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/model/trajectory.hpp"

namespace tutti::evaluation {

/// The length of a trajectory, divided among keyframes on it, so that one can state on what share of the distance
/// something is true. A keyframe stands for the distance from halfway to the keyframe before it until halfway to the
/// one after it; the first and the last one also stand for all that lies before and after.
class KeyframeTrajectory {
 public:
  /// `trajectory`: all its poses; `keyframes`: poses at some of its stamps. Both by increasing stamps.
  KeyframeTrajectory(std::span<const StampedPose> trajectory, const Trajectory& keyframes);

  /// Length of the trajectory, also when there are no keyframes.
  [[nodiscard]] double whole_m() const { return whole_m_; }
  /// Length that the keyframes at the stamps of `poses` stand for together. `poses`: a range of anything with a
  /// `stamp`, increasing; stamps of no keyframe do not count.
  template <class Poses>
  [[nodiscard]] double part_m(const Poses& poses) const {
    double sum_m = 0.0;
    auto share = shares_.begin();
    for (const auto& pose : poses) {
      while (share != shares_.end() && share->stamp < pose.stamp) ++share;
      if (share == shares_.end()) break;
      if (share->stamp == pose.stamp) sum_m += share->distance_m;
    }
    return sum_m;
  }

 private:
  struct Share {
    Timestamp stamp;
    double distance_m = 0.0;
  };
  std::vector<Share> shares_;
  double whole_m_ = 0.0;
};

}  // namespace tutti::evaluation
