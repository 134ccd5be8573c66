// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "tutti/model/trajectory.hpp"

namespace tutti::robot {

/// A step that no body can make: the odometry's front end started again, or lost track. How the robot really moved is
/// unknown.
struct OdometryJump {
  Timestamp from, to;
  double translation_m = 0.0, rotation_rad = 0.0;  ///< As in the odometry.
  friend bool operator==(const OdometryJump&, const OdometryJump&) = default;
};
/// Text such as "odometry jumps by 500.0 m and 0.0 degrees within 0.100 s at 1700000000000000000 ns".
std::string to_string(const OdometryJump& jump);

/// Removes jumps from odometry. At a step that no body can make, the robot is assumed to stay where it is and to go on
/// from there, so that `odom` is always the frame of the first sample. Before the first jump the output equals the
/// input, bit for bit. The output is a function of the samples so far.
///
/// In a step of dt a body can move by a slack (1 m, 30 degrees: noise, and corrections by the front end), plus dt times
/// the allowed speed. This is ten times the greatest speed so far, plus what an acceleration of 10 m/s^2 (50 rad/s^2)
/// adds within dt, but at most 100 m/s (2000 degrees/s); for the first step only these count. A step raises the
/// greatest speed only as far as that acceleration allows.
class OdometryWatch {
 public:
  /// All that the watch remembers.
  struct State {
    std::optional<StampedPose> newest;                 ///< As it was fed.
    std::optional<double> speed_mps, turn_rate_radps;  ///< The greatest so far; nothing before the first step.
    /// The body at the end of the last jump, in both frames.
    struct Anchor {
      Pose3 T_odom_body, T_fed_body;
      friend bool operator==(const Anchor&, const Anchor&) = default;
    };
    std::optional<Anchor> anchor;
    friend bool operator==(const State&, const State&) = default;
  };
  OdometryWatch() = default;
  explicit OdometryWatch(const State& state) : state_(state) {}

  struct Step {
    Pose3 T_odom_body;
    std::optional<OdometryJump> jump;
  };
  /// Adds a finite sample with a unit quaternion. One that is not after the newest is no jump and changes nothing.
  Step take(const StampedPose& fed);
  /// The newest sample in `odom`; the identity before the first.
  [[nodiscard]] Pose3 T_odom_body() const { return state_.newest ? in_odom(state_.newest->pose) : Pose3{}; }
  /// Maps the frame of what is fed now to `odom`; the identity before the first jump.
  [[nodiscard]] Pose3 T_odom_fed() const;
  [[nodiscard]] const State& state() const { return state_; }

 private:
  [[nodiscard]] Pose3 in_odom(const Pose3& T_fed_body) const;

  State state_;
};

}  // namespace tutti::robot
