// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "tutti/mission/record.hpp"
#include "tutti/mission/report/plot.hpp"

/// Where everything is drawn: estimates live in unrelated frames, so for display each is moved by one rigid transform.
namespace tutti::mission {

using Points3d = std::vector<Eigen::Vector3d>;

inline constexpr double kDriftWindow_s = 20.0;

/// One keyframe on an error-over-time plot; NaN = not measured.
struct KeyframeError {
  double distance_m;  ///< Along the odometry keyframes.
  double time_s;      ///< Mission time.
  double onboard_m, corrected_m, server_m;
  double born_m;  ///< What the odometry went wrong by over the last kDriftWindow_s; needs no alignment.
};

/// One robot's trajectories in one frame: the reference's, or the server's where there is no reference.
struct RobotGeometry {
  Points3d onboard, corrected, server;  ///< At keyframes; empty when there is no such estimate.
  Points3d reference;                   ///< All of it; empty when there is none.
  /// Distance to the reference, or without one to the server's estimate, after the alignment; one per odometry
  /// keyframe.
  std::vector<KeyframeError> errors;
  /// Where this robot believes the others to be: as RobotRecord::whereabouts, moved with `corrected`.
  Points3d whereabouts;
  bool has_reference = false;
};
RobotGeometry robot_geometry(const MissionRecord& record, const RobotRecord& robot);

/// Which two coordinates make the view from above: x and y, unless the mission spreads much more along z than along
/// one of them (camera frames, y down).
struct GroundPlane {
  Eigen::Index right = 0;
  Eigen::Index up = 1;
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector3d& p) const { return {p[right], p[up]}; }
  [[nodiscard]] Points2d operator()(const Points3d& points) const;
};
GroundPlane ground_plane(const std::vector<Points3d>& layers);

/// Clock of a picture: `at_start_s` is shown where `start` is.
struct PictureClock {
  Timestamp start;
  double at_start_s = 0.0;
  [[nodiscard]] double operator()(Timestamp stamp) const { return at_start_s + (stamp - start); }
};

/// Mission time of stamps of the robot's own clock.
PictureClock mission_clock(const RobotRecord& robot);

/// Indices [first, last) of the poses from `from` until `until`, with one more on either side: at least a short line.
std::pair<std::size_t, std::size_t> stretch(const Trajectory& trajectory, Timestamp from, Timestamp until);

/// Position of a robot's estimate at a stamp of its keyframes.
const Eigen::Vector3d* find_position(const Trajectory& trajectory, Timestamp stamp);

/// One component of the joint map from above: from `world` to pixels.
struct MapView {
  Pose3 T_display_world;
  GroundPlane ground;
  PlanView view;
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector3d& p_world) const {
    return view(ground(T_display_world * p_world));
  }
};
/// Where a component is displayed: the largest one on the reference, where there is one.
Pose3 display_from_world(const MissionRecord& record, std::uint32_t component);
/// The server's estimate of every robot of a component, displayed.
std::vector<Points3d> displayed_routes(const MissionRecord& record, std::uint32_t component);

/// The loop closures of a component in pixels, by the server's final estimate: within a robot, and between robots.
struct ClosureStrokes {
  Strokes intra, inter;
};
ClosureStrokes closure_strokes(const MissionRecord& record, std::uint32_t component, const MapView& map);

}  // namespace tutti::mission
