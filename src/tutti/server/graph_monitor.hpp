// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// What reading took.
struct MonitorWork {
  std::size_t factorisations = 0;  ///< Of the whole graph, and of that of the closures' ends.
  std::size_t products = 0;        ///< Columns of samples, times products with the graph's Laplacian.
};

/// Reads the latest estimate of the representative nodes into a proxy graph, with each node's uncertainty relative to
/// the robot's previous one. Of a robot's nodes only those of its component count (map_components.hpp);
/// the others (submaps between them are missing) are left out until closures join them. Over failed odometry the
/// covariances are equal shares of what the closures make of the whole stretch. Says how sure it is of each robot's
/// shape (ChainUncertainty), unless the map does not determine its poses. `work`, unless null, counts up.
ProxyGraph monitor_graph(const MapEstimate& map, std::uint64_t revision, const consistency::ProxyGraphConfig& config,
                         MonitorWork* work = nullptr);

}  // namespace tutti::server
