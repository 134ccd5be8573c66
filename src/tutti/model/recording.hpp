// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/input.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/model/visual.hpp"

namespace tutti {

/// The scans of a recording, from files or a simulated sensor. May be called from several threads.
class ScanSource {
 public:
  virtual ~ScanSource() = default;
  /// The sweep that ends at stamp number `sample` (stamp_at() of Recording::scan_stamps); nothing when there is none.
  [[nodiscard]] virtual Result<std::optional<Scan>> scan(std::size_t sample) const = 0;
};

/// The tracked images of a recording, from a file or from a tracker run over images. A source is stateful because of
/// its tracks: one thread must ask for stamps in increasing order.
class VisualSource {
 public:
  virtual ~VisualSource() = default;
  /// The images taken at stamp number `sample` (stamp_at() of Recording::image_stamps), with their stamp; empty when
  /// there are none. Descriptors, which cost most, are computed only for a `keyframe`. After starting in the middle,
  /// tracks have other numbers than a run from the beginning would give them.
  [[nodiscard]] virtual TrackedImages images(std::size_t sample, bool keyframe) = 0;
  /// Errors since the last call, one per image that is missing or corrupt; other images are not affected.
  virtual std::vector<Error> take_errors() { return {}; }
};

/// A segment where simulated odometry really went wrong. Only the evaluation may use it.
struct DriftOrigin {
  enum class Kind { slip, degeneracy, failure };
  Kind kind = Kind::slip;
  Timestamp from;
  Timestamp until;
  double translation_m = 0.0;  ///< Error of the pose increment from -> until.
  double rotation_rad = 0.0;
};

/// One robot's recorded or simulated run: all inputs that a mission replays.
struct Recording {
  RobotId robot;
  std::string name;
  Trajectory odometry;  ///< T_odom_body, raw, drifting.
  /// Covariance of the step from odometry sample k to k + 1; one fewer than odometry.
  std::vector<Matrix6d> increment_covariance;
  Trajectory reference;                     ///< T_reference_body, one frame for all robots; empty when there is none.
  std::shared_ptr<const ScanSource> scans;  ///< Null when there is no range sensor.
  std::shared_ptr<VisualSource> visual;     ///< Null when there is no camera.
  /// The images in which `visual` tracks points; null when it has other sources.
  std::shared_ptr<const ImageStream> images;
  /// Stamps of scans and of images, increasing; when empty, they are the stamps of odometry.
  std::vector<Timestamp> scan_stamps, image_stamps;
  std::vector<ImuSample> imu;  ///< Increasing stamps; empty when there is no IMU.
  ImuNoise imu_noise;
  std::vector<Input> measured;             ///< Position fixes and ranges; stamps do not decrease.
  std::vector<DriftOrigin> drift_origins;  ///< In time order; empty when unknown.
};

/// Puts samples in the place of those of their kind.
template <class Sample>
void set_measured(Recording& recording, const std::vector<Sample>& samples) {
  std::vector<Input>& all = recording.measured;
  std::erase_if(all, [](const Input& input) { return std::holds_alternative<Sample>(input); });
  all.insert(all.end(), samples.begin(), samples.end());
  std::ranges::stable_sort(all, {}, stamp_of);
}
/// The samples of one kind.
template <class Sample>
std::vector<Sample> measured(const Recording& recording) {
  std::vector<Sample> out;
  for (const Input& input : recording.measured)
    if (const auto* const sample = std::get_if<Sample>(&input)) out.push_back(*sample);
  return out;
}

/// Stamp number `i` of scans or images (`stamps` is Recording::scan_stamps or image_stamps); nothing
/// after the last.
inline std::optional<Timestamp> stamp_at(const Recording& recording, const std::vector<Timestamp>& stamps,
                                         std::size_t i) {
  if (!stamps.empty()) return i < stamps.size() ? std::optional(stamps[i]) : std::nullopt;
  return i < recording.odometry.size() ? std::optional(recording.odometry[i].stamp) : std::nullopt;
}

}  // namespace tutti
