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

/// Odometry and sensors run at rates of their own and meet at no stamp; here they become one stream in the order of
/// time, in which every sensor sample has an odometry sample at its very stamp.
namespace tutti::robot {

/// An odometry sample, and how sure its increment since the one before is.
struct OdometryStep {
  Timestamp stamp;
  Pose3 T_odom_body;
  Matrix6d covariance = Matrix6d::Zero();  ///< Right tangent.
  bool is_jump = false;                    ///< How the robot moved is not known (OdometryWatch).
};

/// Two steps, the second of which follows the first, as one to the end of the second; neither is a jump.
OdometryStep joined(const OdometryStep& first, const OdometryStep& second);

/// The step from `from` to `to` in two, at a moment between them: the motion straight and of constant turn, the
/// covariance in proportion to time. Their compound is the step as it was, to rounding.
std::pair<OdometryStep, OdometryStep> split(const StampedPose& from, const OdometryStep& to, Timestamp at);

/// What sensors saw at a moment. Neither: a moment at which one saw something that nobody keeps.
struct SensorSample {
  Timestamp stamp;
  std::optional<Scan> scan;
  std::optional<TrackedImages> images;
};

/// What has been heard and waits for what may still come before it.
struct SensorTimeline {
  std::deque<OdometryStep> odometry;  ///< Increasing stamps.
  std::vector<SensorSample> sensors;  ///< Increasing stamps, each after the last step that was taken.

  /// Of odometry faster than this, two steps become one: sensors need no finer motion, and what waits stays small.
  static constexpr double kFinest_s = 0.004;

  /// A step after the newest one.
  void add(const OdometryStep& step);
  /// Beside what another sensor saw at the same moment.
  void add(SensorSample sample);
  /// The pose at a moment from `last` on, which is the last step that was taken; nothing after the newest step.
  [[nodiscard]] std::optional<Pose3> pose_at(const StampedPose& last, Timestamp at) const;

  struct Moment {
    OdometryStep step;
    std::optional<SensorSample> sensors;
  };
  /// The next moment of the stream, if it is not after `until`. `last` as above.
  std::optional<Moment> take(const StampedPose& last, Timestamp until);
};

}  // namespace tutti::robot
