// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/position_fix.hpp"
#include "tutti/model/robot_range.hpp"

namespace tutti::bags {

/// A device on the robot measured this at its antenna, as its message states it: a receiver's position fix, or a
/// radio's range to another robot. Topics and bags have the same rules for both.
struct AntennaSample {
  /// With the antenna at the body's origin until place_antenna(): no message has where it is mounted.
  std::variant<PositionFix, RobotRange> measured;
  std::string frame;      ///< The antenna's, by frame_name().
  bool is_stated = true;  ///< False for a fix without a covariance, which has unknown_fix_covariance() then.
  bool is_flat = false;   ///< The message has no altitude: the fix is at 0 m, give or take kUnknownAltitude_m.
  [[nodiscard]] Timestamp stamp() const {
    return std::visit([](const auto& of) { return of.stamp; }, measured);
  }
  /// Nothing for a fix.
  [[nodiscard]] const RobotRange* range() const { return std::get_if<RobotRange>(&measured); }
};

/// The standard deviation of an altitude that a receiver does not have (NaN): it decides nothing.
inline constexpr double kUnknownAltitude_m = 1e4;

/// The fix in a message; nothing when the receiver reports that it has none (status -1), or is at 0 degrees north and 0
/// east, as one that has not found itself yet. A covariance of type 0, or with a variance of zero or less (many drivers
/// write 0 or -1), counts as not stated. Fails as check_fix() does.
Result<std::optional<AntennaSample>> to_fix(const RosNavSatFix& message);

/// The robot to which a topic's ranges are, such as "bravo" of "/alpha/range_to/bravo"; empty for a topic of another
/// kind: ranges to walls have the same type.
std::string_view ranged_robot(std::string_view topic);
/// A range to the robot `to`; nothing where the message says that there is none: below its least range or beyond its
/// greatest. Fails as check_range() does.
Result<std::optional<AntennaSample>> to_range(const RosRange& message, std::string_view to);

/// Reads a message of kFixType or kRangeType; nothing also where the topic's ranges are not to a robot.
Result<std::optional<AntennaSample>> read_antenna_sample(std::string_view topic, std::string_view type,
                                                         std::string_view bytes, RosEncoding encoding);

/// Puts the antenna where it is on the body: a receiver's to `p_body_receiver`, which a mission file may say, else
/// where transforms have it; where neither is known, it stays at the body's origin. Returns which of these it is, as
/// "an antenna at [0.50 0.10 1.20] m of the body".
std::string place_antenna(AntennaSample& sample, const std::optional<Eigen::Vector3d>& p_body_receiver,
                          const Result<Pose3>& T_body_antenna);

}  // namespace tutti::bags
