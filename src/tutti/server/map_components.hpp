// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// The component of the map that stands for each chain and robot. Where submaps are missing, a chain is in several
/// components until closures join them. Chosen is the component with the most representative nodes; among equals the
/// one with the most nodes, then the one with the newest node.
struct MapComponents {
  std::map<ChainId, std::uint32_t> of_chain;  ///< Counting the chain's own nodes; for every chain with a node.
  std::map<RobotId, std::uint32_t> of_robot;  ///< Counting the nodes of all its chains; for every robot with a node.
  std::uint32_t largest = 0;                  ///< Counting the nodes of all chains that are in their chain's component.
};

/// Chooses the components of a map's chains and robots.
MapComponents choose_components(const MapEstimate& map);

}  // namespace tutti::server
