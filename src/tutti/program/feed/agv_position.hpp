// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/model/status.hpp"

namespace tutti::program {

/// Where a robot is in a map, as VDA 5050 (version 2.0, state.agvPosition) has it, for whoever speaks that to a fleet
/// manager: one JSON object. `positionInitialized` is true only where the robot is localised; x, y and theta are 0
/// where it has no place. `mapId` of another floor than the
/// first ends in its number. `deviationRange` is InMap::sigma_m, `localizationScore` InMap::overlap.
std::string agv_position(const InMap& in_map);

}  // namespace tutti::program
