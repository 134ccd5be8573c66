// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "tutti/evaluation/association.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::mission {

/// The pose graph's map of the same submaps and closures, made by a judge who knows the reference: closures that are
/// wrong (ClosureCheckConfig) are not there, all others are right for certain, whatever they strain. A map's error over
/// this one's is what judging costs; it is below 1 where closures that are off by less than that are better left out.
/// Closures whose ends have no reference are judged as ever. Nothing where no closure can be checked.
std::optional<server::MapEstimate> judge_perfectly(const server::MapServer& server, const server::MapConfig& config,
                                                   const std::vector<const MissionRecording*>& robots,
                                                   const evaluation::AssociationConfig& association,
                                                   const ClosureCheckConfig& check);

}  // namespace tutti::mission
