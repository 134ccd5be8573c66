// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/model/visual.hpp"

namespace tutti {

/// Where a recording's scans come from: files, or a simulated sensor. Safe to call from several threads.
class ScanSource {
 public:
  virtual ~ScanSource() = default;
  /// The sweep that ends at this moment (Recording::scan_stamps); nothing when there is none.
  [[nodiscard]] virtual Result<std::optional<Scan>> scan(std::size_t sample) const = 0;
};

/// Where a recording's tracked images come from: a file, or a tracker over images. It has a state, the tracks: one
/// thread asks, sample after sample.
class VisualSource {
 public:
  virtual ~VisualSource() = default;
  /// The images taken at this moment (Recording::image_stamps), with its stamp; none when there are none. At a
  /// keyframe, what is
  /// seen will be kept: only there descriptors are needed, which cost most. Tracks that begin after a
  /// restart in the middle have other numbers than those before.
  [[nodiscard]] virtual TrackedImages images(std::size_t sample, bool keyframe) = 0;
  /// What went wrong since the last call: images that are missing or corrupt, one error each, of samples and between
  /// them. They are lost alone.
  virtual std::vector<Error> take_errors() { return {}; }
};

/// Where simulated odometry really went wrong. Known to the evaluation only.
struct DriftOrigin {
  enum class Kind { slip, degeneracy, failure };
  Kind kind = Kind::slip;
  Timestamp from;
  Timestamp until;
  double translation_m = 0.0;  ///< Error of the pose increment from -> until.
  double rotation_rad = 0.0;
};

/// One robot's recorded or simulated run: everything a mission replays.
struct Recording {
  RobotId robot;
  std::string name;
  Trajectory odometry;                         ///< T_odom_body, raw, drifting.
  std::vector<Matrix6d> increment_covariance;  ///< Of odometry k -> k + 1; one fewer than odometry.
  Trajectory reference;                       ///< T_reference_body, one frame for all robots; empty when there is none.
  std::shared_ptr<const ScanSource> scans;    ///< Null when there is no range sensor.
  std::shared_ptr<VisualSource> visual;       ///< Null when there is no camera.
  std::shared_ptr<const ImageStream> images;  ///< That `visual` follows points through; null: it has other sources.
  /// The moments of scans and of images, increasing; none: those of the odometry samples.
  std::vector<Timestamp> scan_stamps, image_stamps;
  std::vector<ImuSample> imu;  ///< Increasing stamps; empty when there is no IMU.
  ImuNoise imu_noise;
  std::vector<DriftOrigin> drift_origins;  ///< In time order; empty when unknown.
};

/// A moment of scans or images (`stamps`: Recording::scan_stamps or image_stamps); nothing after the last.
inline std::optional<Timestamp> moment(const Recording& recording, const std::vector<Timestamp>& stamps,
                                       std::size_t i) {
  if (!stamps.empty()) return i < stamps.size() ? std::optional(stamps[i]) : std::nullopt;
  return i < recording.odometry.size() ? std::optional(recording.odometry[i].stamp) : std::nullopt;
}

}  // namespace tutti
