// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/localise/known_map.hpp"
#include "tutti/mission/localise_mission.hpp"

namespace tutti::mission {

/// Returns localise.json, the figures of robots in a map that does not move; those that depend on this machine's clock
/// are under "timing".
std::string localised_json(const std::vector<LocalisedRobot>& robots, const localise::KnownMap& map);

/// Writes it, localise.json, and a robot each NAME_localised.tum (published poses in the map's frame) and
/// NAME_states.csv (every state with its pose, standard deviations and cause). Fails when a file cannot be written.
Status write_localised(const std::vector<LocalisedRobot>& robots, const localise::KnownMap& map,
                       const std::filesystem::path& out_dir);

/// The same for a console: a table of the robots, and the changes of their states.
std::string localised_text(const std::vector<LocalisedRobot>& robots, const localise::KnownMap& map);

}  // namespace tutti::mission
