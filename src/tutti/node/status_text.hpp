// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/model/status.hpp"

namespace tutti::node {

/// A table for people. `silent_s`: for how long the server has not been heard; 0: it is there.
std::string mission_status_text(const MissionStatus& status, double silent_s);

}  // namespace tutti::node
