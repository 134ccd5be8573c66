// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>

#include "pose_graph.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::python {

/// T_world_body at the keyframes of every chain.
std::map<ChainId, Trajectory> trajectories_of(const server::MapEstimate& map);
/// The map's pose graph, with stamps.
Graph graph_of(const server::MapEstimate& map);

}  // namespace tutti::python
