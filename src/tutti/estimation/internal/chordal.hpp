// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/estimation/internal/block_structure.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::estimation::internal {

/// initialise_chordal on a graph already analysed. False = singular, `poses` unchanged. `poses` starts as graph.poses.
[[nodiscard]] bool chordal(const PoseGraph& graph, const BlockStructure& structure, std::vector<Pose3>& poses);

}  // namespace tutti::estimation::internal
