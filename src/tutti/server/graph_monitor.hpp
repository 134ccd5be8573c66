// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/model/proxy_graph.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// The cost of monitor_graph().
struct MonitorWork {
  std::size_t factorisations = 0;  ///< The whole graph's, and the graph's of the closures' ends.
  std::size_t products = 0;        ///< Columns of samples times products with the graph's Laplacian.
  MonitorWork& operator+=(const MonitorWork& other) {
    factorisations += other.factorisations;
    products += other.products;
    return *this;
  }
};

/// The graph monitor: makes a proxy graph of the latest estimates of the representative nodes, with the covariance of
/// each node relative to its chain's previous one. It takes the nodes of each chain's chosen component
/// (map_components.hpp) and leaves the others out, which missing submaps separate from them, until closures join them.
/// Over failed odometry the covariances are equal shares of what the closures make of the whole segment. A robot was
/// last seen in its newest session, or in that of `owners`; of these sessions, which robots hear about, the graph says
/// how sure the server is of the trajectory's shape (ChainUncertainty), unless the map does not determine its poses.
/// `work`, unless null, is increased.
ProxyGraph monitor_graph(const MapEstimate& map, std::uint64_t revision, const consistency::ProxyGraphConfig& config,
                         std::span<const ChainId> owners = {}, MonitorWork* work = nullptr);

}  // namespace tutti::server
