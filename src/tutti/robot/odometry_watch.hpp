// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "tutti/base/config.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::robot {

struct OdometryWatchConfig {
  double max_speed_mps = 100.0;       ///< Whatever the robot is, it is not faster,
  double max_turn_rate_dps = 2000.0;  ///< nor does it turn faster.
  template <class V>
  void describe(V& v) {
    v.field(
        "max_speed_mps", max_speed_mps, greater_than(0.0),
        "Odometry that moves faster has jumped: its front end began anew, or lost itself. So has a step that is ten "
        "times as fast as any before.");
    v.field("max_turn_rate_dps", max_turn_rate_dps, greater_than(0.0), "The same of turning.");
  }
};

/// A step that no body makes: the front end began anew, or lost itself. How the robot moved is not known.
struct OdometryJump {
  Timestamp from, to;
  double translation_m = 0.0, rotation_rad = 0.0;  ///< As the front end says.
  friend bool operator==(const OdometryJump&, const OdometryJump&) = default;
};
/// "odometry jumps by 500.0 m and 0.0 degrees within 0.100 s at 1700000000000000000 ns"
std::string to_string(const OdometryJump& jump);

/// Odometry that never jumps, of a front end that may. Where what is fed makes a step that no body makes, the robot is
/// taken to stay, and goes on from there: `odom` is the frame of the first sample, always. As long as nothing jumps,
/// what comes out is what went in, to the bit. Of what it has seen it is a function: the same samples, the same
/// answers.
///
/// What a body can do: at most a slack (1 m, 30 degrees: noise, and corrections of a front end), and beside it ten
/// times the greatest speed so far and what an acceleration of 10 m/s^2 (50 rad/s^2) adds over the step, but no more
/// than the settings say, which alone hold for the first step. A speed counts as seen as far as it can be reached so.
class OdometryWatch {
 public:
  /// All that it knows.
  struct State {
    std::optional<StampedPose> newest;                 ///< As fed.
    std::optional<double> speed_mps, turn_rate_radps;  ///< The greatest so far; nothing: no step yet.
    /// The last jump ended here, in either frame.
    struct Anchor {
      Pose3 T_odom_body, T_fed_body;
      friend bool operator==(const Anchor&, const Anchor&) = default;
    };
    std::optional<Anchor> anchor;
    friend bool operator==(const State&, const State&) = default;
  };
  OdometryWatch() = default;
  OdometryWatch(const OdometryWatchConfig& config, const State& state) : config_(config), state_(state) {}

  struct Step {
    Pose3 T_odom_body;
    std::optional<OdometryJump> jump;
  };
  /// A sample that is finite, of a unit quaternion; after the newest one, otherwise it is no jump and nothing changes.
  Step take(const StampedPose& fed);
  /// The newest sample in `odom`; the identity before the first.
  [[nodiscard]] Pose3 T_odom_body() const { return state_.newest ? in_odom(state_.newest->pose) : Pose3{}; }
  /// From the front end's frame of now; the identity while nothing has jumped.
  [[nodiscard]] Pose3 T_odom_fed() const;
  [[nodiscard]] const State& state() const { return state_; }

 private:
  [[nodiscard]] Pose3 in_odom(const Pose3& T_fed_body) const;

  OdometryWatchConfig config_;
  State state_;
};

}  // namespace tutti::robot
