// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "tutti/mission/record.hpp"
#include "tutti/mission/report/plot.hpp"

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
  /// Positions where this robot assumes the others to be: RobotRecord::whereabouts, moved with `corrected`.
  Points3d whereabouts;
  bool has_reference = false;
};
/// The geometry of one robot of the record.
RobotGeometry robot_geometry(const MissionRecord& record, const RobotRecord& robot);

/// Chooses the two coordinates of the view from above: x and y, unless the mission extends much more along z than along
/// one of them (camera frames, y down).
struct GroundPlane {
  Eigen::Index right = 0;
  Eigen::Index up = 1;
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector3d& p) const { return {p[right], p[up]}; }
  [[nodiscard]] Points2d operator()(const Points3d& points) const;
};
GroundPlane ground_plane(const std::vector<Points3d>& layers);

/// The time axis of a picture: it shows `at_start_s` at the stamp `start`.
struct PictureClock {
  Timestamp start;
  double at_start_s = 0.0;
  [[nodiscard]] double operator()(Timestamp stamp) const { return at_start_s + (stamp - start); }
};

/// Turns stamps of the robot's own clock into mission time.
PictureClock mission_clock(const RobotRecord& robot);

/// Indices [first, last) of the poses from `from` until `until`, with one more on either side, so that there is a line
/// to draw.
std::pair<std::size_t, std::size_t> stretch(const Trajectory& trajectory, Timestamp from, Timestamp until);

/// Position of a robot's estimate at the stamp of a keyframe; null when it has none there.
const Eigen::Vector3d* find_position(const Trajectory& trajectory, Timestamp stamp);

/// One component of the joint map seen from above: maps points of `world` to pixels.
struct MapView {
  Pose3 T_display_world;
  GroundPlane ground;
  PlanView view;
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector3d& p_world) const {
    return view(ground(T_display_world * p_world));
  }
};
/// T_display_world of a component: the largest is shown in the reference's frame, where there is one.
Pose3 display_from_world(const MissionRecord& record, std::uint32_t component);
/// The server's estimates of all robots of a component, in the display frame.
std::vector<Points3d> displayed_routes(const MissionRecord& record, std::uint32_t component);

/// The loop closures of a component in pixels, by the server's final estimate: within one robot, and between two.
struct ClosureStrokes {
  Strokes intra, inter;
};
ClosureStrokes closure_strokes(const MissionRecord& record, std::uint32_t component, const MapView& map);

}  // namespace tutti::mission
