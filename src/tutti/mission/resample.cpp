// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/resample.hpp"

#include <algorithm>
#include <utility>

#include "tutti/model/pose_at.hpp"

namespace tutti::mission {

Status resample(Recording& recording, double rate_hz, double phase_s) {
  const Trajectory& old = recording.odometry;
  std::vector<Timestamp> stamps;
  for (const StampedPose& sample : old) stamps.push_back(sample.stamp);
  Trajectory odometry;
  const double seconds = stamps.back() - stamps.front();
  for (std::size_t i = 0; phase_s + static_cast<double>(i) / rate_hz <= seconds; ++i) {
    const Timestamp stamp = stamps.front() + (phase_s + static_cast<double>(i) / rate_hz);
    if (const auto pose = pose_at(old, stamp)) odometry.push_back({stamp, *pose});
  }
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
