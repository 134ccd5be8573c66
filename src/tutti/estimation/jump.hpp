// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "tutti/model/relative_pose.hpp"

namespace tutti::estimation {

/// One odometry step that is wrong by itself, and a motion of it: what its neighbours say, or what odometry said.
struct OdometryJump {
  std::size_t step = 0;
  RelativePose motion;
  friend bool operator==(const OdometryJump&, const OdometryJump&) = default;
};

/// Squared distance that odometry is off by once in a million times: chi-square, 6 degrees of freedom.
inline constexpr double kJumpGap = 38.258;

/// Odometry that jumps (a slip, a frame matched wrongly) is wrong in one step and right on either side; shared out over
/// a stretch, the correction would bend what was right. Given that the steps [begin, end) of `odometry` should lead as
/// `begin_end` says, finds the one that jumped: the mean of the four nearest steps, as uncertain as such a guess is
/// nearby, explains where the stretch leads, and doubting the step by as much does not. That is: doubted, the squared
/// distance to where it should lead, in the covariance of both, is more than kJumpGap; guessed, a tenth of that or
/// less; and the less strange the step is beside the guess, the more must be explained. Returns the step that explains
/// most, with that guess; nothing in a chain of fewer than some fifteen steps, or when more than one step jumped.
/// `duration_s`: what every step of `odometry` took; empty when all took the same. A body moves evenly in time, not in
/// keyframes: what jumps is a keyframe at once.
std::optional<OdometryJump> find_jump(std::span<const RelativePose> odometry, std::size_t begin, std::size_t end,
                                      const RelativePose& begin_end, std::span<const double> duration_s = {});

}  // namespace tutti::estimation
