// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/estimation/internal/block_structure.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::estimation::internal {

/// Poses from the measurements alone (Martinec & Pajdla 2007; Carlone et al., "Initialization techniques for 3D SLAM",
/// ICRA 2015, section III-B): rotations minimise sum kappa ||R_j - R_i R_ij||_F^2 without the constraint R in SO(3) and
/// are then projected; given them, translations minimise their part of the pose graph's cost exactly (full 3x3
/// information). kappa is the mean rotational information of the edge.
/// `poses` starts as graph.poses: the first node of each connected component keeps its pose, no other is read.
/// False = singular, `poses` unchanged.
[[nodiscard]] bool chordal(const PoseGraph& graph, const BlockStructure& structure, std::vector<Pose3>& poses);

}  // namespace tutti::estimation::internal
