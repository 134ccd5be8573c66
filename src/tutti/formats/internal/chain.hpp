// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "tutti/model/pose_graph.hpp"

namespace tutti::formats::internal {

/// Sets graph.poses (already sized, one per id) by walking along the edges from pose 0 at the origin, such that every
/// pose is reached over as few edges between non-consecutive ids as possible (ids[i] belongs to poses[i]). Wrong
/// closures thus spoil as little as they can. Returns the number of connected components; poses outside the first one
/// are left as they are.
std::size_t chain_poses(PoseGraph& graph, std::span<const std::int64_t> ids);

}  // namespace tutti::formats::internal
