// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "tutti/evaluation/association.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::mission {

/// The map that a perfect judge of closures would make: the pose graph's map of the same submaps and of the closures
/// that the server has judged (of a large fleet not all that it knows, spare_pairs.hpp), where wrong closures
/// (ClosureCheckConfig, by the reference) are left out and all others are certain, whatever they contradict. The error
/// of the actual map divided by this map's is the price of judging; it can be below 1, where closures within the limits
/// are better left out. Closures whose ends have no reference are judged as usual. Nothing when no closure can be
/// checked.
std::optional<server::MapEstimate> judge_perfectly(const server::MapServer& server, const server::MapConfig& config,
                                                   const std::vector<const MissionRecording*>& robots,
                                                   const evaluation::AssociationConfig& association,
                                                   const ClosureCheckConfig& check);

}  // namespace tutti::mission
