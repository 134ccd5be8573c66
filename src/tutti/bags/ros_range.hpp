// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/model/robot_range.hpp"

namespace tutti::bags {

/// The robot to which a topic's ranges are, such as "bravo" of "/alpha/range_to/bravo"; empty for a topic of another
/// kind: ranges to walls have the same type.
std::string_view ranged_robot(std::string_view topic);

/// A range as its sender states it, with the antenna at the body's origin, as the message does not have where it is
/// mounted. Nothing where the message says that there is none: below its least range or beyond its greatest. Fails as
/// check_range() does.
Result<std::optional<RobotRange>> to_range(const RosRange& message, std::string_view to);

}  // namespace tutti::bags
