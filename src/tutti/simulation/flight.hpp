// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "tutti/base/config.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::simulation {

/// A flight round a hall, between the boxes in its middle and those along its walls, looking ahead and towards the
/// walls. Every round sees the places of the previous one from slightly different positions.
struct FlightConfig {
  double duration_s = 60.0;
  double rate_hz = 10.0;
  double round_s = 40.0;       ///< Time for one round, counter-clockwise.
  double semi_length_m = 6.0;  ///< Half axis of the flown ellipse along x.
  double semi_width_m = 4.0;   ///< Half axis of the flown ellipse along y.
  double height_m = 1.8;
  double wobble_m = 0.3;  ///< Largest deviation from the ellipse, in every direction.
  double tilt_deg = 5.0;  ///< Largest roll and pitch.
  /// Direction of view, from the direction of flight to the right, towards the walls.
  double look_outwards_deg = 35.0;
  double start_deg = 0.0;
  template <class V>
  void describe(V& v) {
    v.field("duration_s", duration_s, above_zero_to(7.0 * 86400.0), "Length of the flight.");
    v.field("height_m", height_m, between(0.0, 100.0), "Mean height above the floor.");
    v.field("start_deg", start_deg, between(-360.0, 360.0), "Where on the ellipse it begins.");
  }
};

/// The state of a smooth motion at one time.
struct Motion {
  Pose3 T_world_body;                                          ///< Body frame: x ahead, z up.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< m/s, world frame.
  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();      ///< m/s^2, world frame.
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< rad/s, body frame.
};

/// The state at a time of the flight. The motion is a sum of sines in time, so all derivatives are exact.
Motion flight_motion(const FlightConfig& config, double time_s);

/// The poses of a flight at rate_hz; the first stamp is `start`.
Trajectory simulate_flight(const FlightConfig& config, Timestamp start);

}  // namespace tutti::simulation
