// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/mission/record.hpp"

namespace tutti::mission {

/// report.json: the figures of a mission under stable keys (docs/report.md). A function of the record without its
/// timing: same seed, same bytes. Not measured or not finite = null. Metres and seconds to 1e-6.
std::string report_json(const MissionRecord& record);

/// timing.json: what depends on this machine's clock.
std::string timing_json(const MissionRecord& record);

}  // namespace tutti::mission
