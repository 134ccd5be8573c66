// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/keyframe_trajectory.hpp"

#include <algorithm>

namespace tutti::evaluation {

KeyframeTrajectory::KeyframeTrajectory(std::span<const StampedPose> trajectory, const Trajectory& keyframes) {
  std::vector<double> length_m{0.0};  // up to each pose
  for (std::size_t i = 1; i < trajectory.size(); ++i)
    length_m.push_back(length_m.back() + (trajectory[i].pose.translation - trajectory[i - 1].pose.translation).norm());
  whole_m_ = length_m.back();
  const auto up_to = [&](Timestamp stamp) {
    const auto next = std::ranges::lower_bound(trajectory, stamp, {}, &StampedPose::stamp);
    return next == trajectory.end() ? whole_m_ : length_m[static_cast<std::size_t>(next - trajectory.begin())];
  };
  double from_m = 0.0;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    const double to_m =
        k + 1 < keyframes.size() ? 0.5 * (up_to(keyframes[k].stamp) + up_to(keyframes[k + 1].stamp)) : length_m.back();
    shares_.push_back({keyframes[k].stamp, to_m - from_m});
    from_m = to_m;
  }
}

}  // namespace tutti::evaluation
