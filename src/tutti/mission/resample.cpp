// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/resample.hpp"

#include <algorithm>
#include <utility>

#include "tutti/geometry/pose3.hpp"

namespace tutti::mission {
namespace {

/// Between `k` and the sample after it, smoothly, as a body moves: interpolating in straight lines cuts off the corners
/// of a trajectory that is known every 0.4 s, by centimetres and a degree. Catmull and Rom's curve, by the pyramid of
/// Barry and Goldman (SIGGRAPH 1988) with interpolations of poses.
Pose3 smoothly(const Trajectory& trajectory, std::size_t k, Timestamp stamp) {
  const auto between = [&](const Pose3& a, const Pose3& b, std::size_t from, std::size_t to) {
    return interpolate(a, b, (stamp - trajectory[from].stamp) / (trajectory[to].stamp - trajectory[from].stamp));
  };
  const std::size_t first = k > 0 ? k - 1 : k, last = std::min(k + 2, trajectory.size() - 1);
  const Pose3 middle = between(trajectory[k].pose, trajectory[k + 1].pose, k, k + 1);
  const Pose3 before =
      first == k ? middle
                 : between(between(trajectory[first].pose, trajectory[k].pose, first, k), middle, first, k + 1);
  const Pose3 after =
      last == k + 1 ? middle
                    : between(middle, between(trajectory[k + 1].pose, trajectory[last].pose, k + 1, last), k, last);
  return between(before, after, k, k + 1);
}

}  // namespace

std::vector<Timestamp> stamps_of(const Trajectory& trajectory) {
  std::vector<Timestamp> out;
  for (const StampedPose& sample : trajectory) out.push_back(sample.stamp);
  return out;
}

Status resample(Recording& recording, double rate_hz, double phase_s) {
  const Trajectory& old = recording.odometry;
  std::vector<Timestamp> stamps;
  for (const StampedPose& sample : old) stamps.push_back(sample.stamp);
  Trajectory odometry{old.front()};
  const double seconds = stamps.back() - stamps.front();
  std::size_t before = 0;
  for (std::size_t i = 0; phase_s + static_cast<double>(i) / rate_hz < seconds; ++i) {
    const Timestamp stamp = stamps.front() + (phase_s + static_cast<double>(i) / rate_hz);
    if (stamp <= odometry.back().stamp) continue;
    while (before + 2 < old.size() && stamps[before + 1] <= stamp) ++before;
    odometry.push_back({stamp, smoothly(old, before, stamp)});
  }
  if (odometry.back().stamp < old.back().stamp) odometry.push_back(old.back());
  if (odometry.size() < 2)
    return fail(ErrorCode::invalid, "odometry_hz: {} samples at {} Hz from {} s on in a recording of {} s, expected 2",
                odometry.size(), rate_hz, phase_s, seconds);
  std::vector<Matrix6d> covariances;
  std::size_t k = 0;  // of the old increments
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    const Timestamp from = odometry[i - 1].stamp, until = odometry[i].stamp;
    Matrix6d covariance = Matrix6d::Zero();
    while (k + 1 < stamps.size() && stamps[k + 1] <= from) ++k;
    for (std::size_t j = k; j + 1 < stamps.size() && stamps[j] < until; ++j) {
      const double part_s = std::min(until, stamps[j + 1]) - std::max(from, stamps[j]);
      covariance += (part_s / (stamps[j + 1] - stamps[j])) * recording.increment_covariance[j];
    }
    covariances.push_back(covariance);
  }
  if (recording.scan_stamps.empty()) recording.scan_stamps = stamps;
  if (recording.image_stamps.empty()) recording.image_stamps = stamps;
  recording.odometry = std::move(odometry);
  recording.increment_covariance = std::move(covariances);
  return {};
}

}  // namespace tutti::mission
