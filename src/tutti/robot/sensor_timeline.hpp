// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/model/visual.hpp"

/// Merges odometry and sensor data, which come at rates of their own and never at the same stamps, into one stream in
/// order of time. In it every sensor sample has an odometry sample at exactly its stamp.
namespace tutti::robot {

/// An odometry sample with the covariance of the step since the previous one.
struct OdometryStep {
  Timestamp stamp;
  Pose3 T_odom_body;
  Matrix6d covariance = Matrix6d::Zero();  ///< Right tangent.
  bool is_jump = false;                    ///< How the robot moved in this step is unknown (OdometryWatch).
};

/// Two consecutive steps as one, to the end of the second; neither may be a jump.
OdometryStep joined(const OdometryStep& first, const OdometryStep& second);

/// Divides the step from `from` to `to` at a time between them: straight motion with a constant turn rate, covariance
/// in proportion to time. Compounding the two gives the step again, up to rounding.
std::pair<OdometryStep, OdometryStep> split(const StampedPose& from, const OdometryStep& to, Timestamp at);

/// The data of sensors at one time. With neither, it is a time at which a sensor saw something that nobody keeps.
struct SensorSample {
  Timestamp stamp;
  std::optional<Scan> scan;
  std::optional<TrackedImages> images;
};

/// Odometry and sensor data that were heard, and wait because something earlier may still come.
struct SensorTimeline {
  std::deque<OdometryStep> odometry;  ///< Increasing stamps.
  std::vector<SensorSample> sensors;  ///< Increasing stamps, all after the last step that was taken.

  /// Odometry steps closer together than this are joined: sensors need no finer motion, and the queue stays small.
  static constexpr double kFinest_s = 0.004;

  /// Adds a step after the newest one.
  void add(const OdometryStep& step);
  /// Adds sensor data, to what another sensor saw at the same time if there is any.
  void add(SensorSample sample);
  /// The pose at a time not before `last`, the last step that was taken; nothing after the newest step.
  [[nodiscard]] std::optional<Pose3> pose_at(const StampedPose& last, Timestamp at) const;

  /// The step that ends at one instant of the stream, and what sensors saw then.
  struct Instant {
    OdometryStep step;
    std::optional<SensorSample> sensors;
  };
  /// Takes the next instant of the stream, unless it is after `until`. `last` is the last step that was taken.
  std::optional<Instant> take(const StampedPose& last, Timestamp until);
};

}  // namespace tutti::robot
