// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/base/timestamp.hpp"

namespace tutti::node {

/// Something wrong with a robot's run, for people: localisation failed or the map is wrong, a sensor gives nothing or
/// is set up wrongly, odometry jumped.
struct RobotAlert {
  std::string text;
  Timestamp since;        ///< The newest sample when the alert was first raised.
  Timestamp from, until;  ///< The segment that the alert is about.
  friend bool operator==(const RobotAlert&, const RobotAlert&) = default;
};

}  // namespace tutti::node
