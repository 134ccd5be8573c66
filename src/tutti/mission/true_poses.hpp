// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "tutti/evaluation/association.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/server/map_estimate.hpp"

/// Checks closures against the reference, where there is one (even if trajectories are not scored against it).
namespace tutti::mission {

/// The reference poses of the keyframes at which these closures end, for those that have one.
std::map<KeyframeId, Pose3> true_ends(std::span<const LoopClosure> closures, const server::MapEstimate& map,
                                      const std::vector<const MissionRecording*>& robots,
                                      const evaluation::AssociationConfig& association);

/// The error of a closure (right tangent; m, rad); nothing when an end has no reference.
std::optional<Vector6d> closure_error(const LoopClosure& closure, const std::map<KeyframeId, Pose3>& truth);

/// True if the error exceeds either limit of `check`.
bool is_wrong(const Vector6d& error, const ClosureCheckConfig& check);

}  // namespace tutti::mission
