// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/position_fix.hpp"

namespace tutti::bags {

/// A position fix as a receiver's message states it.
struct ReceivedFix {
  PositionFix fix;  ///< The antenna is set to the body's origin, because the message does not have where it is mounted.
  std::string frame;       ///< Frame of the antenna, by frame_name().
  bool is_stated = false;  ///< The message states a covariance; otherwise fix.covariance is unknown_fix_covariance().
  bool is_flat = false;    ///< The message has no altitude: fix.antenna is at 0 m, give or take kUnknownAltitude_m.
};

/// The standard deviation of an altitude that a receiver does not have (NaN): it decides nothing.
inline constexpr double kUnknownAltitude_m = 1e4;

/// The fix in a message; nothing when the receiver reports that it has none (status -1), or is at 0 degrees north and 0
/// east, as one that has not found itself yet. A covariance of type 0, or with a variance of zero or less (many drivers
/// write 0 or -1), counts as not stated. Fails as check_fix() does.
Result<std::optional<ReceivedFix>> to_fix(const RosNavSatFix& message);

}  // namespace tutti::bags
