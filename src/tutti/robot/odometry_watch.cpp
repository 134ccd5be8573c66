// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/odometry_watch.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "tutti/geometry/so3.hpp"

namespace tutti::robot {
namespace {

// No robot moves faster: a front end that says so began anew, or lost itself.
constexpr double kMostSpeed_mps = 100.0, kMostTurnRate_radps = 2000.0 * kRadPerDeg;

/// One kind of motion: of translation or rotation.
struct Bound {
  double slack = 0.0;         // m, rad
  double acceleration = 0.0;  // per s^2
  double most_rate = 0.0;     // per s

  [[nodiscard]] bool allows(double size, double dt_s, const std::optional<double>& greatest) const {
    constexpr double kTimesGreatest = 10.0;
    const double rate = greatest ? std::min(most_rate, kTimesGreatest * *greatest + acceleration * dt_s) : most_rate;
    return size <= slack + rate * dt_s;
  }
  /// After such a step.
  [[nodiscard]] double greatest(double size, double dt_s, const std::optional<double>& before) const {
    const double rate = size / dt_s;
    return before ? std::max(*before, std::min(rate, *before + acceleration * dt_s)) : std::min(rate, most_rate);
  }
};

}  // namespace

std::string to_string(const OdometryJump& jump) {
  return fmt::format("odometry jumps by {:.1f} m and {:.1f} degrees within {:.3f} s at {} ns", jump.translation_m,
                     jump.rotation_rad / kRadPerDeg, jump.to - jump.from, jump.to.ns);
}

OdometryWatch::Step OdometryWatch::take(const StampedPose& fed) {
  if (!state_.newest) {
    state_.newest = fed;
    return {fed.pose, std::nullopt};
  }
  const auto [before, T_before] = *state_.newest;
  const double dt_s = fed.stamp - before;
  if (dt_s <= 0.0) return {in_odom(fed.pose), std::nullopt};
  const Bound translation{1.0, 10.0, kMostSpeed_mps};
  const Bound rotation{30.0 * kRadPerDeg, 50.0, kMostTurnRate_radps};
  const Pose3 step = T_before.inverse() * fed.pose;
  const double metres = step.translation.norm(), radians = rotation_angle(step);
  std::optional<OdometryJump> jump;
  if (translation.allows(metres, dt_s, state_.speed_mps) && rotation.allows(radians, dt_s, state_.turn_rate_radps)) {
    state_.speed_mps = translation.greatest(metres, dt_s, state_.speed_mps);
    state_.turn_rate_radps = rotation.greatest(radians, dt_s, state_.turn_rate_radps);
  } else {
    jump = OdometryJump{before, fed.stamp, metres, radians};
    state_.anchor = State::Anchor{in_odom(T_before), fed.pose};
  }
  state_.newest = fed;
  return {in_odom(fed.pose), jump};
}

Pose3 OdometryWatch::in_odom(const Pose3& T_fed_body) const {
  if (!state_.anchor) return T_fed_body;
  if (T_fed_body == state_.anchor->T_fed_body) return state_.anchor->T_odom_body;  // to the bit: it has stayed
  Pose3 out = state_.anchor->T_odom_body * (state_.anchor->T_fed_body.inverse() * T_fed_body);
  out.rotation.normalize();
  return out;
}

Pose3 OdometryWatch::T_odom_fed() const {
  return state_.anchor ? state_.anchor->T_odom_body * state_.anchor->T_fed_body.inverse() : Pose3{};
}

}  // namespace tutti::robot
