// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "tutti/mission/record.hpp"

/// Places estimates in pictures: they are in unrelated frames, so each is moved by one rigid transform for display.
namespace tutti::mission {

using Points3d = std::vector<Eigen::Vector3d>;

inline constexpr double kDriftWindow_s = 20.0;

/// The errors at one keyframe, for the plot over time; NaN: not measured.
struct KeyframeError {
  double distance_m;  ///< Along the odometry keyframes.
  double time_s;      ///< Mission time.
  double onboard_m, corrected_m, server_m;
  double born_m;  ///< Error of the odometry over the last kDriftWindow_s, which needs no alignment.
};

/// One robot's trajectories in one frame: the reference's, or the server's when there is no reference.
struct RobotGeometry {
  Points3d onboard, corrected, server;  ///< At keyframes; empty when there is no such estimate.
  Points3d reference;                   ///< All of it; empty when there is none.
  /// After alignment, the distances to the reference (without one, to the server's estimate); one per odometry
  /// keyframe.
  std::vector<KeyframeError> errors;
  Pose3 T_base_odom;  ///< Moves the raw odometry there.
  bool has_reference = false;
};
/// The geometry of one robot of the record.
RobotGeometry robot_geometry(const MissionRecord& record, const RobotRecord& robot);

/// The time axis of a picture: it shows `at_start_s` at the stamp `start`.
struct PictureClock {
  Timestamp start;
  double at_start_s = 0.0;
  [[nodiscard]] double operator()(Timestamp stamp) const { return at_start_s + (stamp - start); }
};

/// Turns stamps of the robot's own clock into mission time.
PictureClock mission_clock(const RobotRecord& robot);

/// T_display_world of a component: the largest is shown in the reference's frame, where there is one.
Pose3 display_from_world(const MissionRecord& record, std::uint32_t component);
}  // namespace tutti::mission
