// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Reads the latest estimate of the representative nodes into a proxy graph, with each node's uncertainty relative to
/// the robot's previous one and its support. Of a robot's nodes only those of its component count (map_components.hpp);
/// the others (submaps between them are missing) are left out until closures join them. Over failed odometry the
/// covariances are equal shares of what the closures make of the whole stretch. Says how sure it is of each robot's
/// shape, unless the map does not determine its poses.
ProxyGraph monitor_graph(const MapEstimate& map, std::uint64_t revision, const consistency::ProxyGraphConfig& config);

/// How many independent closures support the stretch between consecutive chosen nodes of one chain: the closures of the
/// chain with itself that span it, plus for every other chain the smaller number of closures before and after it
/// (closures on both sides make a cycle through the stretch). `chosen` are indices into map.nodes, all of one chain, in
/// order; result[0] = 0.
std::vector<std::uint32_t> closure_support(const MapEstimate& map, const std::vector<std::size_t>& chosen);

}  // namespace tutti::server
