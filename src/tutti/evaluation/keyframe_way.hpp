// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/model/trajectory.hpp"

namespace tutti::evaluation {

/// The way along a trajectory, shared out among keyframes on it: each stands for the way from half-way to the keyframe
/// before it to half-way to the one after it; the first and the last also for all before and after them.
class KeyframeWay {
 public:
  KeyframeWay(std::span<const StampedPose> way, const Trajectory& keyframes);

  /// The whole way; also when no keyframe lies on it.
  [[nodiscard]] double whole_m() const { return whole_m_; }
  /// The part of it that some of the keyframes stand for (all of them: the whole way): `poses` have a stamp each, in
  /// increasing order. Others do not count.
  template <class Poses>
  [[nodiscard]] double part_m(const Poses& poses) const {
    double sum_m = 0.0;
    auto share = shares_.begin();
    for (const auto& pose : poses) {
      while (share != shares_.end() && share->stamp < pose.stamp) ++share;
      if (share == shares_.end()) break;
      if (share->stamp == pose.stamp) sum_m += share->way_m;
    }
    return sum_m;
  }

 private:
  struct Share {
    Timestamp stamp;
    double way_m = 0.0;
  };
  std::vector<Share> shares_;
  double whole_m_ = 0.0;
};

}  // namespace tutti::evaluation
