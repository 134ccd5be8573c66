// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/model/status.hpp"

namespace tutti::node {

/// A table of the mission's status for people. `silent_s` is how long the server was not heard, 0 when it is there.
std::string mission_status_text(const MissionStatus& status, double silent_s);

}  // namespace tutti::node
